//! Vulkan, through `ash`: evaluation on a device, its work lists and memory, the self-test and
//! recovery from errors. One type owns one Vulkan object and destroys it; unsafe code is allowed.
#![allow(unsafe_code)]

#[cfg(feature = "prove")]
pub(crate) mod application;
pub(crate) mod buffer;
pub(crate) mod cache;
#[cfg(test)]
pub(crate) mod cards;
pub(crate) mod clip_target;
pub(crate) mod crowd;
pub(crate) mod crowd_target;
pub(crate) mod descriptors;
#[cfg(feature = "prove")]
pub(crate) mod details;
pub(crate) mod device;
pub(crate) mod engine;
pub(crate) mod error;
pub(crate) mod exported;
pub(crate) mod from_keys;
pub(crate) mod grid;
pub(crate) mod handles;
pub(crate) mod imported_memory;
pub(crate) mod in_flight;
pub(crate) mod instance;
pub(crate) mod kept_lists;
pub(crate) mod kernel_check;
pub(crate) mod memory_types;
pub(crate) mod options;
pub(crate) mod physical;
pub(crate) mod pipeline;
pub(crate) mod pipeline_cache;
pub(crate) mod queues;
pub(crate) mod read_back;
pub(crate) mod recovery;
pub(crate) mod reports;
pub(crate) mod run;
pub(crate) mod sample_list;
pub(crate) mod self_test;
pub(crate) mod shared_memory;
pub(crate) mod submission;
pub(crate) mod turns;
pub(crate) mod upload;
pub(crate) mod work_list;
#[cfg(feature = "prove")]
pub(crate) mod write_rates;
