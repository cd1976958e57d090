//! The figures of a report, and a page that shows them: for each input two dimensions by
//! each method and by all, then speed, error and path of every box.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use glam::Vec3;
use tumble_formats::motion::Motion;

use crate::arguments::input::check_complete;
use crate::arguments::interpolation::CurveChoice;
use crate::batch::pipeline::clip_file_names;
use crate::commands::info::Steps;
use crate::commands::plot::source::curves::{NAMES, PlotSubject, box_name};
use crate::commands::plot::source::{PlotSamples, PlotSource};
use crate::commands::plot::subjects::{PANELS, moving_boxes};
use crate::commands::plot::{Arguments, FigureWriter, note_curves};
use crate::messages::drawn::{check_has_tracks, note_scalars};
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::{names, words};

/// The dimensions that the original program's report shows, counted from 1.
const DIMENSIONS: [usize; 2] = [2, 16];

/// One figure of the page.
struct ReportFigure {
    file: String,
    caption: String,
}

/// The section of one input.
struct Chapter {
    title: String,
    facts: String,
    figures: Vec<ReportFigure>,
}

pub(crate) fn write(
    arguments: &Arguments,
    writer: &mut FigureWriter,
    samples: &PlotSamples,
) -> Result<(), Failure> {
    let inputs = writer.inputs.clone();
    let page = writer.destination("index.html")?;
    page.check_writable()?;
    let each = figures_of_one(arguments.methods().len());
    let mut progress = Progress::new("drawing", (inputs.len() * each) as u64);
    let mut chapters = Vec::new();
    let outcome = arguments.for_each_input(&inputs, writer, |writer, path| {
        let loaded = arguments.inputs.load(path)?;
        let files = clip_file_names(&loaded.clips);
        for (clip, file) in loaded.clips.iter().zip(files) {
            let name = names::input(path);
            check_has_tracks(&name, clip, "--show scalars draws them, without --report")?;
            note_scalars(&name, clip);
            let choices = arguments.choices(&name, clip)?;
            note_curves(&name, clip, &choices);
            let mut boxes = moving_boxes(&clip.set, &name);
            boxes.truncate(PANELS);
            let stem = match loaded.clips.len() {
                1 => writer.stem(path),
                _ => format!("{}.{file}", writer.stem(path)),
            };
            let chapter = Chapter {
                title: names::clip_title(&writer.title(path), clip),
                facts: facts(clip),
                figures: figures(
                    writer,
                    (path, &stem, clip, boxes),
                    &choices,
                    samples,
                    &mut progress,
                )?,
            };
            chapters.push(chapter);
        }
        check_complete(&names::input(path), &loaded)
    });
    drop(progress);
    if chapters.is_empty() {
        return outcome;
    }
    let text = html(&chapters, &writer.device.label);
    page.write(None, |out| out.write_all(text.as_bytes()))?;
    words::note(&format!(
        "{} and a page, on {} → {page}",
        words::count(writer.drawn.len(), "picture"),
        writer.device.label
    ));
    outcome
}

fn figures_of_one(methods: usize) -> usize {
    DIMENSIONS.len() * (methods + usize::from(methods > 1)) + 3
}

/// Draws all figures of one input.
fn figures(
    writer: &mut FigureWriter,
    (path, stem, clip, boxes): (&PathBuf, &str, &Motion, Vec<usize>),
    choices: &[CurveChoice],
    samples: &PlotSamples,
    progress: &mut Progress,
) -> Result<Vec<ReportFigure>, Failure> {
    let name = names::clip_title(&writer.title(path), clip);
    let mut shown = Vec::new();
    let mut draw =
        |writer: &mut FigureWriter, methods, label: &str, caption, subject: &PlotSubject| {
            let source = PlotSource::new(name.clone(), clip, methods, samples)?;
            let figure = source.figure(&mut writer.device, subject)?;
            let file = format!("{stem}-{label}.{}", writer.format.extension());
            writer.draw(&figure, &file, path)?;
            shown.push(ReportFigure { file, caption });
            progress.advance(1);
            Ok::<(), Failure>(())
        };
    // The dimensions of the original report; for a smaller set, its last dimension instead.
    let mut dimensions = DIMENSIONS
        .map(|dimension| dimension.min(4 * clip.set.track_count()))
        .to_vec();
    dimensions.dedup();
    for dimension in dimensions {
        let subject = PlotSubject::Dimensions(vec![dimension - 1]);
        let (component, index) = (NAMES[(dimension - 1) % 4], (dimension - 1) / 4);
        let about = format!(
            "dimension {dimension}, {component} of {}",
            box_name(&clip.set, index)
        );
        for one in choices.chunks(1) {
            let method = one[0].method;
            let label = format!("{method}-dimension-{dimension}");
            draw(writer, one, &label, format!("{method}: {about}"), &subject)?;
        }
        if choices.len() > 1 {
            let label = format!("all-dimension-{dimension}");
            let caption = format!("all together: {about}");
            draw(writer, choices, &label, caption, &subject)?;
        }
    }
    for (label, caption, subject) in [
        (
            "speed",
            "angular speed: where slerp has corners and splines have none",
            PlotSubject::Speed(boxes.clone()),
        ),
        (
            "error",
            "the angle to a textbook implementation in f64",
            PlotSubject::Error(boxes.clone()),
        ),
        (
            "sphere",
            match clip.skeleton.is_empty() {
                true => "where each box points, seen from the one it hangs from",
                false => "where each joint points, seen from its parent",
            },
            PlotSubject::Sphere(boxes, Vec3::NEG_Y),
        ),
    ] {
        draw(writer, choices, label, caption.to_owned(), &subject)?;
    }
    Ok(shown)
}

fn facts(clip: &Motion) -> String {
    let set = &clip.set;
    let (first, last) = set.time_span().unwrap_or((0.0, 0.0));
    let steps = match Steps::of(set) {
        None => String::new(),
        Some(steps) if steps.are_even() => format!(", a key every {:.4} s", steps.longest),
        Some(Steps { shortest, longest }) => {
            format!(", a key every {shortest:.4} to {longest:.4} s")
        }
    };
    format!(
        "{}, {} in all, from {first} to {last} s{steps}",
        match clip.skeleton.is_empty() {
            true => words::boxes(set.track_count()),
            false => words::count(set.track_count(), "joint"),
        },
        words::count(set.key_count(), "key"),
    )
}

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A file's name inside a page's address.
fn address(file: &str) -> String {
    let mut address = String::new();
    for byte in file.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => {
                address.push(byte.into());
            }
            _ => {
                let _ = write!(address, "%{byte:02X}");
            }
        }
    }
    address
}

const STYLE: &str = "\
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }
body { max-width: 1400px; margin: 2rem auto; padding: 0 1rem }
h1, h2 { line-height: 1.2 }
main section { display: grid; gap: 1.5rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, 560px), 1fr)) }
figure { margin: 0 }
figure img { width: 100%; height: auto; border-radius: 6px; background: #fff }
figcaption, p { opacity: .8 }";

fn html(chapters: &[Chapter], device: &str) -> String {
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Interpolation of rotations</title>\n<style>\n{STYLE}\n</style>\n\
         <h1>Interpolation of rotations</h1>\n\
         <p>Evaluated by tumble {} on {}. Dots are keys. A quaternion and its negative are \
         the same rotation; curves are drawn with the sign that continues them.</p>\n<main>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(device)
    );
    for chapter in chapters {
        let _ = write!(
            text,
            "<h2>{}</h2>\n<p>{}</p>\n<section>\n",
            escaped(&chapter.title),
            escaped(&chapter.facts)
        );
        for figure in &chapter.figures {
            let caption = escaped(&figure.caption);
            let _ = writeln!(
                text,
                "<figure><a href=\"{0}\"><img src=\"{0}\" alt=\"{caption}\" loading=\"lazy\"></a>\
                 <figcaption>{caption}</figcaption></figure>",
                address(&figure.file)
            );
        }
        text.push_str("</section>\n");
    }
    text.push_str("</main>\n</html>\n");
    text
}
