//! The Vulkan instance: loader, validation, and the physical devices.

use std::ffi::{CStr, c_void};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

use ash::{ext, khr, vk};

use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::threads::lock;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The process that created the first instance. Drivers have threads, which do not exist in a forked process.
static USED_BY: OnceLock<u32> = OnceLock::new();

/// An instance. It is destroyed with its last user, unless it belongs to the application.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    pub(crate) debug_utils: bool,
    messenger: Option<Messenger>,
    owned: bool,
    /// The process that created it.
    process: u32,
    /// Keeps the loader library open; last, so that it closes last.
    _entry: ash::Entry,
}

struct Messenger {
    functions: ext::debug_utils::Instance,
    raw: vk::DebugUtilsMessengerEXT,
    /// The messages of the validation layer; boxed, because the callback holds its address.
    messages: Box<Mutex<Vec<String>>>,
}

impl Instance {
    /// Loads Vulkan and creates an instance of version 1.1 or newer.
    ///
    /// # Errors
    /// [`VulkanError::NoLoader`] without a loader, [`VulkanError::NoDevice`] without a driver; else the
    /// call that failed.
    pub(crate) fn new(validation: bool) -> Result<Arc<Self>, VulkanError> {
        // The Vulkan loader returns these errors if it finds no driver.
        let is_absence = |error: &VulkanError| {
            matches!(error, VulkanError::Call { result, .. }
                if *result == vk::Result::ERROR_INCOMPATIBLE_DRIVER)
        };
        Self::create(validation).map_err(|error| match is_absence(&error) {
            true => VulkanError::NoDevice,
            false => error,
        })
    }

    fn create(validation: bool) -> Result<Arc<Self>, VulkanError> {
        if USED_BY
            .get()
            .is_some_and(|&process| process != std::process::id())
        {
            return Err(VulkanError::Forked);
        }
        let entry = loader()?;
        // SAFETY: no requirements beyond a loaded entry.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }
            .named("vkEnumerateInstanceLayerProperties")?;
        let mut layers = layers.iter();
        if validation && !layers.any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION)) {
            return Err(VulkanError::NoValidation);
        }
        let has_extension = |layer: Option<&CStr>, name: &CStr| -> Result<bool, VulkanError> {
            // SAFETY: the layer's name is a valid string.
            let found = unsafe { entry.enumerate_instance_extension_properties(layer) };
            // The Vulkan loader returns this if a driver's manifest (VK_DRIVER_FILES) is not valid JSON.
            if found.as_ref().err() == Some(&vk::Result::ERROR_OUT_OF_HOST_MEMORY) {
                return Err(VulkanError::NoDevice);
            }
            let found = found.named("vkEnumerateInstanceExtensionProperties")?;
            let mut found = found.iter();
            Ok(found.any(|extension| extension.extension_name_as_c_str() == Ok(name)))
        };
        let debug_utils = has_extension(None, ext::debug_utils::NAME)?
            || validation && has_extension(Some(VALIDATION), ext::debug_utils::NAME)?;
        let layers = [VALIDATION.as_ptr()];
        // The Vulkan loader lists drivers that do not support all of Vulkan (MoltenVK) only with this extension and
        // flag.
        let portability = has_extension(None, khr::portability_enumeration::NAME)?;
        let extensions = [
            (debug_utils, ext::debug_utils::NAME),
            (portability, khr::portability_enumeration::NAME),
        ];
        let extensions: Vec<_> = (extensions.iter())
            .filter(|(there, _)| *there)
            .map(|(_, name)| name.as_ptr())
            .collect();
        let flags = match portability {
            true => vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR,
            false => vk::InstanceCreateFlags::empty(),
        };
        let application = vk::ApplicationInfo::default()
            .application_name(c"tumble")
            .engine_name(c"tumble")
            .api_version(vk::API_VERSION_1_3);
        let messages: Box<Mutex<Vec<String>>> = Box::default();
        let mut messenger_info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                    | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(record_message))
            .user_data((&raw const *messages).cast_mut().cast());
        let synchronization = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&synchronization);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers[..usize::from(validation)])
            .flags(flags)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut features).push_next(&mut messenger_info);
        }
        // SAFETY: every pointer in `info` outlives the call; the messenger's user
        // data lives as long as the instance.
        let raw = unsafe { entry.create_instance(&info, None) };
        if raw.as_ref().err() == Some(&vk::Result::ERROR_INCOMPATIBLE_DRIVER)
            && lacks_nvidia_driver()
        {
            return Err(VulkanError::NoNvidiaDriver);
        }
        let raw = raw.named("vkCreateInstance")?;
        USED_BY.get_or_init(std::process::id);
        let mut instance = Self {
            raw,
            debug_utils,
            messenger: None,
            owned: true,
            process: std::process::id(),
            _entry: entry,
        };
        if validation {
            let functions = ext::debug_utils::Instance::new(&instance._entry, &instance.raw);
            messenger_info.p_next = std::ptr::null();
            // SAFETY: the extension is enabled; the user data is boxed and kept.
            let raw = unsafe { functions.create_debug_utils_messenger(&messenger_info, None) }
                .named("vkCreateDebugUtilsMessengerEXT")?;
            instance.messenger = Some(Messenger {
                functions,
                raw,
                messages,
            });
        }
        Ok(Arc::new(instance))
    }

    /// An instance of an application, which must destroy it.
    pub(crate) fn borrowed(entry: ash::Entry, raw: ash::Instance) -> Arc<Self> {
        Arc::new(Self {
            raw,
            debug_utils: false,
            messenger: None,
            owned: false,
            process: std::process::id(),
            _entry: entry,
        })
    }

    /// The loader's version.
    #[cfg(feature = "lab")]
    pub(crate) fn loader_version(&self) -> u32 {
        // SAFETY: no requirements beyond a loaded entry.
        let version = unsafe { self._entry.try_enumerate_instance_version() };
        version.ok().flatten().unwrap_or(vk::API_VERSION_1_0)
    }

    /// The messages of the validation layer so far.
    pub(crate) fn validation_messages(&self) -> Vec<String> {
        let messenger = self.messenger.as_ref();
        messenger.map_or_else(Vec::new, |messenger| lock(&messenger.messages).clone())
    }
}

/// Whether this machine has an NVIDIA card and no manifest of its Vulkan driver.
pub(crate) fn lacks_nvidia_driver() -> bool {
    let folders = [
        "/usr/share/vulkan/icd.d",
        "/usr/local/share/vulkan/icd.d",
        "/etc/vulkan/icd.d",
    ];
    let is_named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
    let is_named = is_named.iter().any(|name| std::env::var_os(name).is_some());
    !is_named && lacks_driver(Path::new("/dev/nvidiactl"), &folders.map(Path::new))
}

fn lacks_driver(card: &Path, folders: &[&Path]) -> bool {
    let is_driver = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|entry| entry.file_name().to_string_lossy().contains("nvidia"))
    };
    let has_driver = |folder: &&Path| folder.read_dir().is_ok_and(|mut all| all.any(is_driver));
    card.exists() && !folders.iter().any(has_driver)
}

/// Homebrew's paths of the loader and of `MoltenVK`, which can be used as a loader; macOS does not search there.
const HOMEBREW: [&str; 4] = [
    "/opt/homebrew/lib/libvulkan.1.dylib",
    "/usr/local/lib/libvulkan.1.dylib",
    "/opt/homebrew/lib/libMoltenVK.dylib",
    "/usr/local/lib/libMoltenVK.dylib",
];

/// The loader's library.
pub(crate) fn loader() -> Result<ash::Entry, VulkanError> {
    // SAFETY: loading a library runs its initialisers, which is intended.
    let default = unsafe { ash::Entry::load() };
    default.or_else(|error| {
        let others = HOMEBREW.iter().filter(|_| cfg!(target_os = "macos"));
        // SAFETY: loading a library runs its initialisers, which is intended.
        let mut found = others.filter_map(|path| unsafe { ash::Entry::load_from(path) }.ok());
        found.next().ok_or_else(|| VulkanError::NoLoader {
            reason: error.to_string(),
        })
    })
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            return; // the drivers' threads are not there
        }
        if let Some(messenger) = &self.messenger {
            // SAFETY: created from this instance and destroyed once.
            unsafe { (messenger.functions).destroy_debug_utils_messenger(messenger.raw, None) };
        }
        if self.owned {
            // SAFETY: every object created from it holds an `Arc` to this.
            unsafe { self.raw.destroy_instance(None) };
        }
    }
}

/// # Safety
/// Called by the loader with valid pointers; `user_data` is the message list.
unsafe extern "system" fn record_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the list lives as long as the messenger; the message is a string
    // unless it is null.
    let (messages, text) = unsafe {
        let messages = &*user_data.cast::<Mutex<Vec<String>>>();
        let text = (*data).message_as_c_str().unwrap_or(c"");
        (messages, text.to_string_lossy().into_owned())
    };
    lock(messages).push(text);
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_card_without_the_file_of_its_driver_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (card, drivers) = (folder.path().join("nvidiactl"), folder.path().join("icd.d"));
        let lacks = || lacks_driver(&card, &[&folder.path().join("none"), &drivers]);
        assert!(!lacks(), "no card");
        fs::write(&card, "").unwrap();
        assert!(lacks());
        fs::create_dir(&drivers).unwrap();
        fs::write(drivers.join("lvp_icd.x86_64.json"), "{}").unwrap();
        assert!(lacks());
        fs::write(drivers.join("nvidia_icd.json"), "{}").unwrap();
        assert!(!lacks());
    }
}
