//! The driver's compiled kernels, kept in a file from process to process.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use ash::vk;

use crate::gpu::physical::PhysicalDevice;
use crate::machine::cache::{Cache, sum};
use crate::machine::options::CacheFiles;
use crate::threads::lock;

/// The maximum size of a cache in bytes: all kernels of a card take a few MB.
const MAX_BYTES: usize = 64 << 20;

/// A pipeline cache of Vulkan; null if it could not be made, which only costs time.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    /// Whether it belongs to an application, which then stores it.
    is_of_application: bool,
    files: Cache,
    name: String,
    /// The expected header of the driver.
    driver: (u32, u32, [u8; 16]),
    /// The checksum of the data that was last read or written.
    known: Mutex<u64>,
    /// Whether a pipeline was made since then.
    has_grown: AtomicBool,
}

impl PipelineCache {
    /// Makes a cache with the stored data of the device's driver, if there are any.
    pub(crate) fn new(device: &ash::Device, physical: &PhysicalDevice, files: &CacheFiles) -> Self {
        let mut cache = Self::unread(physical, Cache::new(files));
        let kept = cache.kept();
        cache.known = Mutex::new(sum(&cache.name, &kept));
        cache.raw = Self::with(device, &kept);
        cache
    }

    /// An application's cache, which the engine does not store.
    pub(crate) fn of_application(raw: vk::PipelineCache, physical: &PhysicalDevice) -> Self {
        Self {
            raw,
            is_of_application: true,
            ..Self::unread(physical, Cache::new(&CacheFiles::Off))
        }
    }

    /// A cache without a Vulkan object.
    fn unread(physical: &PhysicalDevice, files: Cache) -> Self {
        let (vendor, model, uuid) = physical.pipeline_cache;
        let digits: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let name = format!("pipelines-{vendor:x}-{model:x}-{digits}");
        Self {
            raw: vk::PipelineCache::null(),
            is_of_application: false,
            files,
            name,
            driver: physical.pipeline_cache,
            known: Mutex::new(0),
            has_grown: AtomicBool::new(false),
        }
    }

    /// The stored data of the driver; empty if there are only other drivers' data.
    fn kept(&self) -> Vec<u8> {
        let kept = self.files.read(&self.name, MAX_BYTES);
        kept.filter(|kept| is_for(kept, self.driver))
            .unwrap_or_default()
    }

    /// Makes a pipeline cache of Vulkan with data of the driver; null if that fails.
    fn with(device: &ash::Device, data: &[u8]) -> vk::PipelineCache {
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
        // SAFETY: the device is alive, and the data has the header of its driver; the caller destroys the
        // cache.
        unsafe { device.create_pipeline_cache(&info, None) }.unwrap_or_default()
    }

    /// Records that a pipeline was made.
    pub(crate) fn note(&self) {
        self.has_grown.store(true, Ordering::Relaxed);
    }

    /// Stores the pipelines that were compiled since then, if any, together with those that other processes have
    /// stored.
    pub(crate) fn keep(&self, device: &ash::Device) {
        let null = vk::PipelineCache::null();
        if self.is_of_application
            || self.raw == null
            || !self.has_grown.swap(false, Ordering::Relaxed)
        {
            return;
        }
        let mut known = lock(&self.known);
        let kept = self.kept();
        let others = match sum(&self.name, &kept) == *known {
            true => null,
            false => Self::with(device, &kept),
        };
        // SAFETY: both caches are this device's, and no other thread uses `others`.
        let data = unsafe {
            if others == null {
                device.get_pipeline_cache_data(self.raw)
            } else {
                let merged = device.merge_pipeline_caches(others, &[self.raw]);
                let data = merged.and_then(|()| device.get_pipeline_cache_data(others));
                device.destroy_pipeline_cache(others, None);
                data
            }
        };
        let Ok(data) = data else { return };
        let current = sum(&self.name, &data);
        if current != *known && data.len() <= MAX_BYTES {
            self.files.write(&self.name, &data);
            *known = current;
        }
    }

    /// # Safety
    /// Nothing may use the cache any more, and the device must be alive.
    pub(crate) unsafe fn destroy(&self, device: &ash::Device) {
        if self.is_of_application {
            return;
        }
        self.keep(device);
        // SAFETY: promised by the caller; null is allowed.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// Whether data start with this driver's header: its length, 1, vendor, device and UUID.
fn is_for(data: &[u8], (vendor, model, uuid): (u32, u32, [u8; 16])) -> bool {
    let mut header = Vec::with_capacity(32);
    for number in [32, 1, vendor, model] {
        header.extend(u32::to_le_bytes(number));
    }
    header.extend(uuid);
    data.starts_with(&header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_another_driver_compiled_is_left_alone() {
        let driver = (0x10de, 0x2335, [7; 16]);
        let mut data: Vec<u8> = [32u32, 1, 0x10de, 0x2335].map(u32::to_le_bytes).concat();
        data.extend([7; 16]);
        assert!(is_for(&data, driver));
        data.extend(b"compiled kernels");
        assert!(is_for(&data, driver));
        for byte in 0..32 {
            let mut other = data.clone();
            other[byte] ^= 1;
            assert!(!is_for(&other, driver), "{byte}");
            assert!(!is_for(&data[..byte], driver), "{byte}");
        }
    }
}
