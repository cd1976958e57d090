//! Writes logs for tests: the records that a reader needs, and messages in CDR.

/// An MCAP file that is being written, without chunks.
pub(crate) struct LogBuilder {
    bytes: Vec<u8>,
    channels: u16,
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn text(text: &str, out: &mut Vec<u8>) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

impl LogBuilder {
    pub(crate) fn new() -> Self {
        let mut log = Self {
            bytes: MAGIC.to_vec(),
            channels: 0,
        };
        log.record(1, &[0; 8]);
        log
    }

    pub(crate) fn record(&mut self, kind: u8, content: &[u8]) {
        self.bytes.push(kind);
        self.bytes.extend((content.len() as u64).to_le_bytes());
        self.bytes.extend(content);
    }

    /// Adds a topic, and returns its channel.
    pub(crate) fn topic(&mut self, name: &str, schema: &str, encoding: &str) -> u16 {
        self.channels += 1;
        let mut content = self.channels.to_le_bytes().to_vec();
        text(schema, &mut content);
        text("ros2msg", &mut content);
        text("", &mut content);
        self.record(3, &content);
        let mut content = [self.channels.to_le_bytes(); 2].concat();
        text(name, &mut content);
        text(encoding, &mut content);
        content.extend([0; 4]);
        self.record(4, &content);
        self.channels
    }

    /// Adds a message that was logged at a time in nanoseconds.
    pub(crate) fn message(&mut self, channel: u16, logged: u64, data: &[u8]) {
        let mut content = channel.to_le_bytes().to_vec();
        content.extend([0; 4]);
        content.extend(logged.to_le_bytes());
        content.extend(logged.to_le_bytes());
        content.extend(data);
        self.record(5, &content);
    }

    /// The file as it is when recording is interrupted.
    pub(crate) fn unfinished(self) -> Vec<u8> {
        self.bytes
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.record(15, &[0; 4]);
        self.record(2, &[0; 20]);
        self.bytes.extend(MAGIC);
        self.bytes
    }
}

/// A message in little-endian CDR.
pub(crate) struct Message(Vec<u8>);

impl Message {
    /// A message that begins with a header; its stamp is in nanoseconds.
    pub(crate) fn stamped(stamp: u64, frame: &str) -> Self {
        Self(vec![0, 1, 0, 0]).header(stamp, frame)
    }

    /// A list of as many entries.
    pub(crate) fn list(count: u32) -> Self {
        Self(vec![0, 1, 0, 0]).whole(count)
    }

    fn align(&mut self, to: usize) {
        let length = (self.0.len() - 4).next_multiple_of(to) + 4;
        self.0.resize(length, 0);
    }

    pub(crate) fn whole(mut self, number: u32) -> Self {
        self.align(4);
        self.0.extend(number.to_le_bytes());
        self
    }

    pub(crate) fn text(self, text: &str) -> Self {
        let mut message = self.whole(text.len() as u32 + 1);
        message.0.extend(text.as_bytes());
        message.0.push(0);
        message
    }

    pub(crate) fn header(self, stamp: u64, frame: &str) -> Self {
        self.whole((stamp / 1_000_000_000) as u32)
            .whole((stamp % 1_000_000_000) as u32)
            .text(frame)
    }

    pub(crate) fn numbers(mut self, numbers: &[f64]) -> Self {
        for number in numbers {
            self.align(8);
            self.0.extend(number.to_le_bytes());
        }
        self
    }

    /// A pose at x, turned about z by an angle.
    pub(crate) fn pose(self, x: f64, angle: f64) -> Self {
        let (sine, cosine) = (0.5 * angle).sin_cos();
        self.numbers(&[x, 0.0, 0.0, 0.0, 0.0, sine, cosine])
    }

    pub(crate) fn data(self) -> Vec<u8> {
        self.0
    }
}

/// A message with one transform.
pub(crate) fn transform(stamp: u64, frames: [&str; 2], x: f64) -> Vec<u8> {
    let [parent, child] = frames;
    Message::list(1)
        .header(stamp, parent)
        .text(child)
        .pose(x, 0.1 * x)
        .data()
}
