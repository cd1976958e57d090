//! From a set to its rotations: the choice of a route, and its execution on the CPU or a Vulkan device.
//!
//! Every route gives the same bits; they differ in what they prepare and keep. Of a set with fewer samples than keys
//! most of what is prepared would never be used, and a set larger than memory cannot be prepared as a whole.
//!
//! * [`Backend`](backend::Backend): what an engine evaluates on. Its child `route` chooses a
//!   [`SetRoute`](backend::route::SetRoute) for a call, `set` follows it: straight from keys, the intervals with a
//!   sample alone, batches in a thread's cache, or clips.
//! * [`Uploaded`](uploaded::Uploaded): prepared tracks, and their segments on a device: what a clip is. After a device
//!   was lost they are uploaded again.
//! * [`SetPieces`](uploaded::pieces::SetPieces): a set whose segments exceed the memory budget; a window of its result is halved
//!   until the segments of each half fit.

pub(crate) mod backend;
pub(crate) mod uploaded;
