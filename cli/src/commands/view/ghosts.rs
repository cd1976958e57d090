//! Which clips of several inputs are shown at once, at the same moment, and which of their joints are compared.

use tumble_formats::compare::{ClipPair, CommonTimes, CompareError, MatchedTracks};
use tumble_formats::times::clock_text;

use crate::commands::compare::partner;
use crate::commands::view::shown::{Ghost, ShownClip};
use crate::messages::{names, words};

/// The ghosts of all clips of a page.
pub(crate) struct FoundGhosts {
    /// The index of a clip, and a ghost of it.
    ghosts: Vec<(usize, Ghost)>,
    /// Notes for the user about them.
    notes: Vec<String>,
}

impl FoundGhosts {
    pub(crate) fn is_empty(&self) -> bool {
        self.ghosts.is_empty()
    }

    /// Gives the clips their ghosts, and prints the notes about the ghosts.
    pub(crate) fn give(self, shown: &mut [ShownClip]) {
        self.notes.iter().for_each(|note| words::note(note));
        for (index, ghost) in self.ghosts {
            shown[index].ghosts.push(ghost);
        }
    }
}

/// The ghosts of each clip: of every later input the clip of the same animation, if both have a time in common.
pub(crate) fn find_ghosts(shown: &[ShownClip]) -> FoundGhosts {
    let mut found = FoundGhosts {
        ghosts: Vec::new(),
        notes: Vec::new(),
    };
    // The clips of one input are consecutive.
    let mut inputs: Vec<(usize, &[ShownClip])> = Vec::new();
    let mut start = 0;
    for clips in shown.chunk_by(|one, next| one.file == next.file) {
        inputs.push((start, clips));
        start += clips.len();
    }
    for (index, first) in inputs.iter().enumerate() {
        for second in &inputs[index + 1..] {
            found.add([*first, *second]);
        }
    }
    found
}

impl FoundGhosts {
    /// Adds the clips of one input as ghosts of the clips of another. Each input has the index of its first clip.
    fn add(&mut self, inputs: [(usize, &[ShownClip]); 2]) {
        let [(first, clips), (second, others)] = inputs;
        let all = [clips, others].map(|side| -> Vec<Option<&str>> {
            let motions = side.iter().map(ShownClip::motion);
            motions.map(|motion| motion.name.as_deref()).collect()
        });
        let mut is_alone = true;
        for (index, one) in clips.iter().enumerate() {
            let Some(same) = partner([&all[0], &all[1]], index) else {
                continue;
            };
            is_alone = false;
            let both = [one, &others[same]];
            let pair = ClipPair {
                inputs: both.map(|clip| &*clip.name),
                clips: both.map(ShownClip::motion),
                offset: 0.0,
            };
            match pair.common_times() {
                Ok(common) => {
                    let are_placed = both.into_iter().all(ShownClip::has_positions);
                    let (ghost, notes) = ghost_of(second + same, pair, &common, are_placed);
                    self.ghosts.push((first + index, ghost));
                    // The page shows the notes on the other clips when one of them is chosen.
                    if first == 0 {
                        self.notes.extend(notes);
                    }
                }
                Err(error) => self.notes.push(format!(
                    "{error}; they are shown one at a time, chosen in the menu"
                )),
            }
        }
        if is_alone {
            let [one, other] = [clips, others].map(|side| names::input(&side[0].file));
            self.notes.push(format!(
                "{one} and {other}: no animation of one has the name of exactly one of the other; they are shown one \
                 at a time, --animation chooses which are shown together"
            ));
        }
    }
}

/// The second clip of a pair as a ghost of the first, and notes about it. `are_placed`: whether both have positions.
fn ghost_of(
    set: usize,
    pair: ClipPair<'_>,
    common: &CommonTimes,
    are_placed: bool,
) -> (Ghost, Vec<String>) {
    let [first, second] = pair.inputs;
    let both = format!("{first} and {second}");
    let mut lines = Vec::new();
    if common.warning.is_some() {
        let clock = pair.clips[0].time_offset;
        let [start, end] = [common.start, common.end].map(|time| clock_text(clock, time));
        lines.push(format!(
            "{both}: they have the times from {start} to {end} s in common; at others one is shown alone"
        ));
    }
    let mut ghost = Ghost {
        set,
        shift: pair.shift(),
        pairs: Vec::new(),
        in_world: false,
        note: String::new(),
    };
    let relative = match pair.check_parents(pair.clips) {
        Ok(()) => pair.check_spaces(),
        error => error,
    };
    let other_parents = relative.err().map(|error| reason(&error));
    let mut found = pair.tracks().map_err(|error| reason(&error));
    if let (Ok(tracks), true) = (&found, other_parents.is_some())
        && let Err(error) = pair.check_known_parents(&tracks.pairs)
    {
        found = Err(reason(&error));
    }
    ghost.note = match (found, other_parents) {
        (Err(why), _) => format!("not compared: {why}"),
        (Ok(_), Some(why)) if !are_placed => format!("not compared: {why}"),
        (Ok(MatchedTracks { pairs, missing, .. }), other_parents) => {
            ghost.pairs = pairs;
            ghost.in_world = other_parents.is_some();
            let in_world = other_parents.map(|why| format!("compared in the world, because {why}"));
            let lone = missing.iter().zip(pair.inputs);
            let lone = lone.filter(|(names, _)| !names.is_empty());
            let lone = lone.map(|(names, input)| only(names, input));
            let assumed = pair.assumptions().into_iter();
            let all: Vec<String> = assumed.chain(in_world).chain(lone).collect();
            all.join("; ")
        }
    };
    if !ghost.note.is_empty() {
        lines.push(format!("{both}: {}", ghost.note));
    }
    (ghost, lines)
}

/// `a.bvh alone has Tail, Ear`.
fn only(names: &[String], input: &str) -> String {
    const LISTED: usize = 3;
    let first = names.iter().take(LISTED).map(|name| format!("`{name}`"));
    let rest = match names.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {}", words::count(more, "other")),
    };
    let list = first.collect::<Vec<_>>().join(", ");
    format!("{input} alone has {list}{rest}")
}

/// Why two clips are not compared as their rotations are stored, without the options of `tumble compare`.
fn reason(error: &CompareError) -> String {
    match error {
        CompareError::Joints { error } => error.to_string(),
        CompareError::Spaces { world, local } => format!(
            "the rotations of {world} are relative to the world, those of {local} to the parents"
        ),
        CompareError::NoTrackInBoth {
            near: Some([first, second]),
            ..
        } => format!(
            "no joint has the same name in both (`{first}` and `{second}` are similar, but only equal names match)"
        ),
        CompareError::NoTrackInBoth { .. } => "no joint has the same name in both".to_owned(),
        error => error.to_string(),
    }
}
