//! An application's instance of Vulkan, on request with the validation layer, whose messages are kept.
#![allow(unsafe_code)]

use std::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

use ash::{ext, khr, vk};
use tumble::vulkan::VulkanError;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// An instance, which is destroyed together with this.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    messenger: Option<Messenger>,
    /// Keeps the loader library open; the last field, so that it closes last.
    pub(crate) entry: ash::Entry,
}

struct Messenger {
    functions: ext::debug_utils::Instance,
    raw: vk::DebugUtilsMessengerEXT,
    /// The messages of the validation layer; boxed, because the callback has its address.
    messages: Box<Mutex<Vec<String>>>,
}

/// Adds the name of the failed function to an error.
pub(crate) trait Named<T> {
    fn named(self, call: &'static str) -> Result<T, VulkanError>;
}

impl<T> Named<T> for ash::prelude::VkResult<T> {
    fn named(self, call: &'static str) -> Result<T, VulkanError> {
        self.map_err(|result| VulkanError::Call { call, result })
    }
}

/// Whether extensions have this name.
fn has(all: &[vk::ExtensionProperties], name: &CStr) -> bool {
    all.iter()
        .any(|extension| extension.extension_name_as_c_str() == Ok(name))
}

impl Instance {
    /// An instance of this version of Vulkan.
    pub(crate) fn new(
        entry: ash::Entry,
        api_version: u32,
        validation: bool,
    ) -> Result<Self, VulkanError> {
        // SAFETY: no requirements beyond a loaded entry.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }
            .named("vkEnumerateInstanceLayerProperties")?;
        let mut layers = layers.iter();
        if validation && !layers.any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION)) {
            return Err(VulkanError::NoValidation);
        }
        // SAFETY: no requirements beyond a loaded entry.
        let there = unsafe { entry.enumerate_instance_extension_properties(None) }
            .named("vkEnumerateInstanceExtensionProperties")?;
        // The Vulkan loader lists drivers that do not support all of Vulkan (MoltenVK) only with this extension and
        // flag. The layer has the other extension.
        let portability = has(&there, khr::portability_enumeration::NAME);
        let extensions = [
            (validation, ext::debug_utils::NAME),
            (portability, khr::portability_enumeration::NAME),
        ];
        let extensions: Vec<_> = (extensions.iter())
            .filter(|(is_used, _)| *is_used)
            .map(|(_, name)| name.as_ptr())
            .collect();
        let flags = match portability {
            true => vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR,
            false => vk::InstanceCreateFlags::empty(),
        };
        let application = vk::ApplicationInfo::default()
            .application_name(c"tumble-verify")
            .api_version(api_version);
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
        let layers = [VALIDATION.as_ptr()];
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers[..usize::from(validation)])
            .flags(flags)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut features).push_next(&mut messenger_info);
        }
        // SAFETY: every pointer in `info` outlives the call; the messages live as long as the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.named("vkCreateInstance")?;
        let mut instance = Self {
            raw,
            messenger: None,
            entry,
        };
        if validation {
            let functions = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
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
        Ok(instance)
    }

    /// The physical device with this UUID, in the form of [`DeviceInfo`](tumble::vulkan::DeviceInfo).
    pub(crate) fn physical_device(&self, uuid: &str) -> Result<vk::PhysicalDevice, VulkanError> {
        // SAFETY: the instance is alive.
        let all = unsafe { self.raw.enumerate_physical_devices() };
        let mut all = all.named("vkEnumeratePhysicalDevices")?.into_iter();
        let found = all.find(|&device| {
            // SAFETY: the device was enumerated from this instance.
            let properties = unsafe { self.raw.get_physical_device_properties(device) };
            if properties.api_version < vk::API_VERSION_1_1 {
                return false;
            }
            let mut id = vk::PhysicalDeviceIDProperties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut id);
            // SAFETY: the device was enumerated from this instance, and has Vulkan 1.1.
            unsafe { (self.raw).get_physical_device_properties2(device, &mut properties) };
            let digits: String = id.device_uuid.map(|byte| format!("{byte:02x}")).concat();
            digits == uuid.replace('-', "")
        });
        found.ok_or(VulkanError::NoDevice)
    }

    /// Whether a physical device has these extensions.
    pub(crate) fn extensions<const COUNT: usize>(
        &self,
        device: vk::PhysicalDevice,
        names: [&CStr; COUNT],
    ) -> Result<[bool; COUNT], VulkanError> {
        // SAFETY: the device was enumerated from this instance.
        let all = unsafe { (self.raw).enumerate_device_extension_properties(device) }
            .named("vkEnumerateDeviceExtensionProperties")?;
        Ok(names.map(|name| has(&all, name)))
    }

    /// The messages of the validation layer so far.
    pub(crate) fn validation_messages(&self) -> Vec<String> {
        let messages = self.messenger.as_ref().map(|messenger| {
            let messages = messenger.messages.lock();
            messages.unwrap_or_else(PoisonError::into_inner).clone()
        });
        messages.unwrap_or_default()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(messenger) = &self.messenger {
            // SAFETY: created from this instance and destroyed once.
            unsafe { (messenger.functions).destroy_debug_utils_messenger(messenger.raw, None) };
        }
        // SAFETY: the device of the application, the only object that is made from it, is gone.
        unsafe { self.raw.destroy_instance(None) };
    }
}

/// # Safety
/// Called by the loader with valid pointers; `user_data` is the list of messages.
unsafe extern "system" fn record_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the list lives as long as the messenger; the message is a string unless it is null.
    let (messages, text) = unsafe {
        let messages = &*user_data.cast::<Mutex<Vec<String>>>();
        let text = (*data).message_as_c_str().unwrap_or(c"");
        (messages, text.to_string_lossy().into_owned())
    };
    let mut messages = messages.lock().unwrap_or_else(PoisonError::into_inner);
    messages.push(text);
    vk::FALSE
}
