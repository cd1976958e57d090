//! Results of sets in chunks or some tracks at a time: for results larger than memory, for iterators, and for work
//! that can be stopped between chunks.

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::fill;
use crate::evaluate::pieces::PreparedWindow;
use crate::machine::plan::Chunks;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::preparation::SetRequest;
use crate::stream::{Chunk, run};

impl Engine {
    /// Evaluates a request in chunks of about `chunk` values.
    pub(crate) fn stream_request<E: From<Error>>(
        &self,
        request: &SetRequest<'_>,
        layout: Layout,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let plan = self.plan(request, layout, Encoding::F32, Some(chunk));
        let whole = Window::of(request.tracks.clone(), request.samples.clone(), layout);
        let (windows, quantity) = (whole.cut(chunk), request.interpolation.quantity);
        // Errors that can be found in advance are returned before the first chunk.
        request.check().map_err(Error::from)?;
        match plan.chunks {
            Chunks::PreparedOnce => {
                let prepared = PreparedWindow::whole(&self.machine, request);
                let prepared = prepared.map_err(Error::from)?;
                let fill_chunk = |window: &Window, output: &mut [Quat]| {
                    let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(output));
                    Ok(prepared.evaluate_into(window, output)?)
                };
                run(windows, quantity, fill_chunk, sink)
            }
            Chunks::Single | Chunks::Each | Chunks::SomeTracks => {
                let fill_chunk = |window: &Window, output: &mut [Quat]| {
                    let part = request.part(window.tracks.clone(), window.samples.clone());
                    let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(output));
                    let plan = plan.of_chunk(request, window);
                    Ok(fill(&self.machine, &part, &plan, output)?)
                };
                run(windows, quantity, fill_chunk, sink)
            }
        }
    }

    /// Evaluates a request into memory, in an encoding, if they fit.
    pub(crate) fn fill_request(
        &self,
        request: &SetRequest<'_>,
        layout: Layout,
        output: EncodedOutput<'_>,
    ) -> Result<(), Error> {
        let (encoding, timeline) = (output.encoding, request.timeline);
        check_encoding(encoding, request.interpolation.quantity)?;
        let window = Window::of(request.tracks.clone(), request.samples.clone(), layout);
        let tracks = request.set.track_count();
        check_window(&window, tracks, timeline.len(), encoding, output.bytes)?;
        if output.len() == 0 {
            return Ok(());
        }
        let plan = self.plan(request, layout, encoding, None);
        Ok(fill(&self.machine, request, &plan, output)?)
    }
}
