//! The first half of a file: joints, their offsets and channels, up to `MOTION`.

use std::collections::HashSet;
use std::io::BufRead;

use glam::DVec3;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::motion::origin::SMALL;
use crate::motion::{WrittenChannel, WrittenJoint};
use crate::names::line_name;
use crate::text::lines::Lines;
use crate::text::number;

/// The first word of every file.
pub(super) const FIRST_WORD: &str = "HIERARCHY";

/// Words that may follow channels on the same line.
const AFTER_CHANNELS: [&str; 4] = ["}", "JOINT", "END", "OFFSET"];

/// The joints of a file, parents before their children.
#[derive(Debug, Default)]
pub(super) struct Hierarchy {
    pub(super) joints: Vec<HierarchyJoint>,
    /// Number of channels of all joints together, which is the number of columns of a row.
    pub(super) columns: usize,
}

#[derive(Debug)]
pub(super) struct HierarchyJoint {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) offset: DVec3,
    /// The axes of the joint's rotation channels in their order, each with its column in a row.
    pub(super) rotations: Vec<(usize, usize)>,
    /// The axes of the joint's position channels, each with its column in a row.
    pub(super) positions: Vec<(usize, usize)>,
    /// The channels in their order, and the End Sites.
    pub(super) written: WrittenJoint,
}

/// A word of the hierarchy: its location, and the word.
struct Word {
    line: u64,
    column: u64,
    text: String,
}

impl Word {
    fn is(&self, keyword: &str) -> bool {
        self.text.eq_ignore_ascii_case(keyword)
    }
}

/// An open brace.
struct Block {
    /// The line of the keyword before it, for messages.
    line: u64,
    /// The joint; `None` for an End Site.
    joint: Option<usize>,
    /// The joint that an End Site belongs to.
    end_of: Option<usize>,
    has_offset: bool,
    has_channels: bool,
}

struct Parser<'a, R> {
    lines: &'a mut Lines<R>,
    /// The current line, and the offset of the next word in it, in bytes and in characters.
    line: String,
    at: usize,
    column: u64,
    open: Vec<Block>,
    names: HashSet<String>,
    hierarchy: Hierarchy,
}

impl Hierarchy {
    /// Reads all up to the line of `MOTION`.
    pub(super) fn read<R: BufRead>(lines: &mut Lines<R>) -> Result<Self, Diagnostic> {
        let mut parser = Parser {
            lines,
            line: String::new(),
            at: 0,
            column: 1,
            open: Vec::new(),
            names: HashSet::new(),
            hierarchy: Self::default(),
        };
        match parser.next()? {
            Some(word) if word.is(FIRST_WORD) => {}
            Some(word) => {
                let message = format!("`{}` found where {FIRST_WORD} is expected", word.text);
                return Err(parser.refuse(&word, Code::BvhStart, message));
            }
            None => {
                let message = format!("the file is empty; a BVH file begins with {FIRST_WORD}");
                return Err(parser.lines.refuse_end(Code::BvhStart, message));
            }
        }
        while parser.statement()? {}
        if let Some(word) = parser.word_before(&[]) {
            let message = format!("`{}` after MOTION; begin a new line", word.text);
            return Err(parser.refuse(&word, Code::BvhWord, message));
        }
        Ok(parser.hierarchy)
    }
}

impl<R: BufRead> Parser<'_, R> {
    /// Reads a keyword and its statement; `false` after `MOTION`.
    fn statement(&mut self) -> Result<bool, Diagnostic> {
        let Some(word) = self.next()? else {
            let message = "the file ends without MOTION; is it truncated?".to_owned();
            return Err(self.lines.refuse_end(Code::BvhMotion, message));
        };
        // The joint that contains the word. An End Site contains only an OFFSET.
        let block = self.open.last();
        let (in_joint, outside) = (block.is_some_and(|b| b.joint.is_some()), block.is_none());
        match word.text.to_ascii_uppercase().as_str() {
            "ROOT" if outside => self.joint(&word)?,
            "JOINT" if in_joint => self.joint(&word)?,
            "END" if in_joint => {
                while self.word_before(&["{"]).is_some() {} // `Site`, and perhaps a name
                self.brace(&word, None)?;
            }
            "OFFSET" if block.is_some_and(|block| !block.has_offset) => self.offset(&word)?,
            "CHANNELS" if in_joint && block.is_some_and(|block| !block.has_channels) => {
                self.channels(&word)?;
            }
            "}" => self.close(&word)?,
            "MOTION" if outside && !self.hierarchy.joints.is_empty() => return Ok(false),
            "MOTION" | "ROOT" if !outside => {
                let line = block.map_or(0, |block| block.line);
                let message = format!("the braces of line {line} are not closed; add `}}`");
                return Err(self.refuse(&word, Code::BvhBraces, message));
            }
            other => {
                let message = if other == FIRST_WORD {
                    let message = "a second HIERARCHY; a file holds one, split it".to_owned();
                    return Err(self.refuse(&word, Code::BvhSecond, message));
                } else if ["ROOT", "JOINT", "END", "OFFSET", "CHANNELS", "MOTION"].contains(&other)
                {
                    "is not expected here; a ROOT contains an OFFSET, CHANNELS and JOINTs, or an End Site"
                } else {
                    "is not a keyword of BVH; remove it"
                };
                let message = format!("`{}` {message}", word.text);
                return Err(self.refuse(&word, Code::BvhWord, message));
            }
        }
        Ok(true)
    }

    /// Reads `ROOT name {` or `JOINT name {`; the name is the rest of the line.
    fn joint(&mut self, keyword: &Word) -> Result<(), Diagnostic> {
        let start = self.at;
        while self.word_before(&["{"]).is_some() {}
        let name = self.line[start..self.at].trim().to_owned();
        let parent = self.open.last().and_then(|block| block.joint);
        let joints = &mut self.hierarchy.joints;
        let joint = joints.len();
        let unique_name = line_name(&name, joint, &mut self.names);
        if unique_name != name && !name.is_empty() {
            let message = format!(
                "the joint called `{name}` is read as `{unique_name}`, so that names are unique"
            );
            self.lines.warn(keyword.column, Code::SameName, message);
        }
        joints.push(HierarchyJoint {
            name: unique_name,
            parent,
            offset: DVec3::ZERO,
            rotations: Vec::new(),
            positions: Vec::new(),
            written: WrittenJoint::default(),
        });
        self.brace(keyword, Some(joint))
    }

    /// Reads the brace after a joint's name or `End Site`.
    fn brace(&mut self, keyword: &Word, joint: Option<usize>) -> Result<(), Diagnostic> {
        match self.next()? {
            Some(word) if word.text == "{" => {}
            Some(word) => {
                let message = format!(
                    "`{}` where the `{{` of line {} is missing",
                    word.text, keyword.line
                );
                return Err(self.refuse(&word, Code::BvhBraces, message));
            }
            None => {
                let message = "the file ends where `{` is missing; is it truncated?".to_owned();
                return Err(self.refuse(keyword, Code::BvhBraces, message));
            }
        }
        self.open.push(Block {
            line: keyword.line,
            joint,
            end_of: self.open.last().and_then(|block| block.joint),
            has_offset: false,
            has_channels: false,
        });
        Ok(())
    }

    fn close(&mut self, brace: &Word) -> Result<(), Diagnostic> {
        let Some(block) = self.open.pop() else {
            let message = "`}` closes nothing; remove it".to_owned();
            return Err(self.refuse(brace, Code::BvhBraces, message));
        };
        if let Some(joint) = block.joint.filter(|_| !block.has_offset) {
            let name = &self.hierarchy.joints[joint].name;
            let message = format!(
                "`{name}` of line {} has no OFFSET; write `OFFSET x y z`",
                block.line
            );
            return Err(self.refuse(brace, Code::BvhOffset, message));
        }
        Ok(())
    }

    /// Reads `OFFSET x y z`.
    fn offset(&mut self, keyword: &Word) -> Result<(), Diagnostic> {
        let mut offset = [0.0; 3];
        for coordinate in &mut offset {
            let Some(word) = self.word_before(&["}"]) else {
                let message = "OFFSET lacks a number; it is `OFFSET x y z`".to_owned();
                return Err(self.refuse(keyword, Code::BvhOffset, message));
            };
            let number = number::parse(&word.text)
                .map_err(|(code, message)| self.refuse(&word, code, message))?;
            *coordinate = number.value;
        }
        if let Some(block) = self.open.last_mut() {
            block.has_offset = true;
            match (block.joint, block.end_of) {
                (Some(joint), _) => self.hierarchy.joints[joint].offset = offset.into(),
                (None, Some(joint)) => {
                    let (exact, site) = (DVec3::from(offset), DVec3::from(offset).as_vec3());
                    let lost = (site.as_dvec3() - exact).abs().max_element();
                    if exact.abs().max_element() >= SMALL && lost > 0.0 {
                        // Round to three digits, but print without an exponent.
                        let lost = format!("{lost:.2e}").parse().unwrap_or(lost);
                        let message = format!(
                            "an End Site is stored in f32, up to {lost} from its position in the file"
                        );
                        self.lines
                            .warn(keyword.column, Code::EndSiteRounded, message);
                    }
                    self.hierarchy.joints[joint].written.end_sites.push(site);
                }
                (None, None) => {}
            }
        }
        Ok(())
    }

    /// Reads `CHANNELS count name…`, on one line.
    fn channels(&mut self, keyword: &Word) -> Result<(), Diagnostic> {
        let Some(count) = self.word_before(&AFTER_CHANNELS) else {
            let message = "CHANNELS without a number; write the number of channels and their names, or `CHANNELS 0` for a \
                           joint that does not move"
                .to_owned();
            return Err(self.refuse(keyword, Code::BvhChannelCount, message));
        };
        let (mut names, mut named) = (Vec::new(), 0usize);
        while let Some(word) = self.word_before(&AFTER_CHANNELS) {
            named += 1;
            // Seven names are enough for the message: there are only six channels, so one of seven occurs twice.
            if names.len() < 7 {
                names.push(word);
            }
        }
        if count.text.parse() != Ok(named) {
            let message = match (count.text.parse::<usize>(), named) {
                (Ok(_), 1) => format!("CHANNELS says `{}`, but 1 name follows", count.text),
                (Ok(_), _) => format!("CHANNELS says `{}`, but {named} names follow", count.text),
                (Err(_), _) => format!(
                    "CHANNELS has `{}` instead of the number of channels; write the number, then the names",
                    count.text
                ),
            };
            return Err(self.refuse(&count, Code::BvhChannelCount, message));
        }
        let Some(block) = self.open.last_mut() else {
            return Ok(());
        };
        block.has_channels = true;
        let joint = block.joint.unwrap_or_default();
        for word in &names {
            let Some(channel) = WrittenChannel::named(&word.text) else {
                let message = format!(
                    "`{}` is not a channel; channels are Xposition and Xrotation, and the same for Y and Z",
                    word.text
                );
                return Err(self.refuse(word, Code::BvhChannel, message));
            };
            let joint = &mut self.hierarchy.joints[joint];
            let (axis, channels) = match channel {
                WrittenChannel::Position(axis) => (axis, &mut joint.positions),
                WrittenChannel::Rotation(axis) => (axis, &mut joint.rotations),
            };
            if channels.iter().any(|&(other, _)| other == axis) {
                let message = format!("the joint has `{}` twice; remove one", word.text);
                return Err(self.refuse(word, Code::BvhChannel, message));
            }
            channels.push((axis, self.hierarchy.columns));
            joint.written.channels.push(channel);
            self.hierarchy.columns += 1;
        }
        Ok(())
    }

    /// The next word, of this line or a later one.
    fn next(&mut self) -> Result<Option<Word>, Diagnostic> {
        loop {
            if let Some(word) = self.word_before(&[]) {
                return Ok(Some(word));
            }
            self.lines.reuse(std::mem::take(&mut self.line));
            let Some(line) = self.lines.next()? else {
                return Ok(None);
            };
            (self.line, self.at, self.column) = (line, 0, 1);
        }
    }

    /// The next word of this line, unless it is one of `stops`. A brace is a separate word.
    fn word_before(&mut self, stops: &[&str]) -> Option<Word> {
        let rest = &self.line[self.at..];
        let start = rest.find(|c| c != ' ' && c != '\t')?;
        let word = &rest[start..];
        let end = match word.find(|c| " \t{}".contains(c)) {
            Some(0) => 1,
            Some(end) => end,
            None => word.len(),
        };
        let text = word[..end].to_owned();
        if stops.iter().any(|stop| stop.eq_ignore_ascii_case(&text)) {
            return None;
        }
        let column = self.column + start as u64;
        self.column = column + text.chars().count() as u64;
        self.at += start + end;
        Some(Word {
            line: self.lines.number,
            column,
            text,
        })
    }

    fn refuse(&self, word: &Word, code: Code, message: String) -> Diagnostic {
        let (line, column) = (word.line, word.column);
        Diagnostic {
            location: Some(Location::Text { line, column }),
            ..self.lines.refuse(column, code, message)
        }
    }
}
