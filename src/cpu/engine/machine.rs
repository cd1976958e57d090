//! The trait `Machine` for the CPU.

use std::sync::Arc;

use crate::cpu::engine::CpuEngine;
use crate::machine::error::EvaluateError;
use crate::machine::plan::{Limits, MachineKind, Rows};
use crate::machine::poses::PassRunner;
use crate::machine::{Machine, MachineClip};
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::preparation::SetRequest;
use crate::prepare::prepared::Prepared;
use crate::simd::dispatch::VectorWidth;
use crate::threads::Threads;
use crate::time::frames::Timeline;

impl Machine for CpuEngine {
    fn limits(&self) -> Limits {
        Limits {
            kind: MachineKind::Cpu {
                threads: self.threads().count(),
            },
            memory: self.memory,
            group_bytes: None,
            prepares_arcs_from: None,
            kept_segments: Some(self.kept_segments),
        }
    }

    fn width(&self) -> VectorWidth {
        self.width
    }

    fn threads(&self) -> &Threads {
        (self.private_threads.as_ref()).unwrap_or_else(|| Threads::of_process())
    }

    #[cfg(not(smallest))]
    fn rows(
        &self,
        request: &SetRequest<'_>,
        rows: Rows,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        Ok(match rows {
            Rows::FromKeys(curve) => self.evaluate_from_keys(request, curve, output),
            Rows::SparseSamples => self.evaluate_sparse(request, output),
            Rows::Batches { cuts_tracks } => self.evaluate_batches(request, cuts_tracks, output),
        }?)
    }

    fn clip(self: Arc<Self>, data: ClipData) -> Result<Box<dyn MachineClip>, EvaluateError> {
        Ok(Box::new(CpuClip {
            engine: self,
            data: Arc::new(data),
        }))
    }

    fn passes(
        &self,
        work: &mut dyn FnMut(&dyn PassRunner) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        work(self)
    }
}

/// Prepared tracks, which the CPU evaluates without copying them.
struct CpuClip {
    engine: Arc<CpuEngine>,
    data: Arc<ClipData>,
}

impl MachineClip for CpuClip {
    fn data(&self) -> &Arc<ClipData> {
        &self.data
    }

    fn evaluate(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        let whole = Window::whole(self.data.track_count(), timeline.len(), layout);
        let mut quats = OutputBuffer::new(whole.len())?;
        let output = bytemuck::cast_slice_mut(&mut quats);
        (self.engine).evaluate(&self.data, timeline, &whole, output)?;
        Ok(Box::new(quats))
    }

    fn evaluate_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        let (engine, data) = (&self.engine, &self.data);
        Ok(match output.into_values() {
            Ok(values) => engine.evaluate(data, timeline, window, values),
            Err(encoded) => engine.evaluate_encoded(data, timeline, window, encoded),
        }?)
    }

    fn take_segments(&mut self) -> Vec<Prepared> {
        ClipData::take_groups(&mut self.data)
    }

    fn replace(&mut self, data: ClipData) -> Result<(), EvaluateError> {
        self.data = Arc::new(data);
        Ok(())
    }
}
