//! Colours of methods, boxes and components: the same in plots, pages and pictures.
//! The common ones are Okabe and Ito's, which people with any colour vision tell apart.

use tumble::paths::PathFrame;
use tumble::{METHODS, Method};
use tumble_formats::sample::MethodChoice;

/// Red, green, blue.
pub(crate) type Colour = [u8; 3];

pub(crate) const INK: Colour = [0x22, 0x26, 0x2b];
pub(crate) const PALE: Colour = [0x6b, 0x72, 0x7a];
pub(crate) const GRID: Colour = [0xe3, 0xe6, 0xea];
pub(crate) const AXIS: Colour = [0x9a, 0xa1, 0xa9];

const VERMILLION: Colour = [0xd5, 0x5e, 0x00];
const BLUE: Colour = [0x00, 0x72, 0xb2];
const GREEN: Colour = [0x00, 0x9e, 0x73];
const PINK: Colour = [0xcc, 0x79, 0xa7];
const SKY: Colour = [0x56, 0xb4, 0xe9];
const ORANGE: Colour = [0xe6, 0x9f, 0x00];

/// The colours of w, x, y and z.
pub(crate) const COMPONENTS: [Colour; 4] = [INK, VERMILLION, GREEN, BLUE];

/// The colours of the axes x, y and z.
pub(crate) const AXES: [Colour; 3] = [VERMILLION, GREEN, BLUE];

/// The colours of minimal, fixed and Frenet's frames.
const FRAMES: [Colour; 3] = [GREEN, BLUE, VERMILLION];

/// The colours of the boxes of a chain, from the first on, then again from the start.
pub(crate) const BOXES: [Colour; 6] = [BLUE, ORANGE, GREEN, PINK, SKY, VERMILLION];

/// The colours of methods that are not in that list.
const OTHERS: [Colour; 9] = [
    [0x7f, 0x7f, 0x7f],
    [0xbc, 0x9a, 0x00],
    [0x8c, 0x56, 0x4b],
    [0x94, 0x67, 0xbd],
    [0xc4, 0x4e, 0x52],
    [0x4d, 0x93, 0x2a],
    [0x3b, 0x4c, 0xc0],
    [0x17, 0x8f, 0x9e],
    [0xa3, 0x00, 0x59],
];

/// The colour of results whose channels each have their own method.
pub(crate) const AUTHORED: Colour = [0xe7, 0x29, 0x8a];

/// The colour of a choice of method.
pub(crate) fn of_choice(choice: MethodChoice) -> Colour {
    choice.0.map_or(AUTHORED, of_method)
}

/// A method has one colour, wherever it is drawn.
pub(crate) fn of_method(method: Method) -> Colour {
    common(method.name).unwrap_or_else(|| {
        let others = METHODS.iter().filter(|other| common(other.name).is_none());
        let index = others.take_while(|&&other| other != method).count();
        // After the last colour, the list repeats with darker colours.
        let darker = 2 + index / OTHERS.len();
        OTHERS[index % OTHERS.len()].map(|part| (usize::from(part) * 2 / darker) as u8)
    })
}

fn common(name: &str) -> Option<Colour> {
    Some(match name {
        "slerp" => VERMILLION,
        "catmull-rom" => BLUE,
        "bessel-overhauser" => GREEN,
        "b-spline" => PINK,
        "c2" => SKY,
        "squad" => ORANGE,
        _ => return None,
    })
}

/// The colour of bodies with a path frame.
pub(crate) fn of_frame(frame: PathFrame) -> Colour {
    FRAMES[frame as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_methods_share_a_colour() {
        let mut colours = METHODS.map(of_method).to_vec();
        colours.push(AUTHORED);
        colours.sort_unstable();
        assert!(colours.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
