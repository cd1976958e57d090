//! Devices by name: what `--device` may call those that `tumble devices` lists.

use tumble::{Device, VulkanError};

use crate::arguments::device::no_vulkan;
use crate::messages::exit::Failure;
use crate::messages::words;

/// The device meant, of those that `tumble devices` lists: by index, by its whole
/// name, by part of its name, in this order (a card may be called by a number). Behind `uuid:` it is
/// the UUID that Vulkan tells, which other programs of the machine know the card by.
pub(super) fn named(given: &str, devices: &[Device]) -> Result<Device, Failure> {
    if devices.is_empty() {
        return Err(no_vulkan(&VulkanError::NoDevice));
    }
    let part = given.to_lowercase();
    if let Some(uuid) = part.strip_prefix("uuid:") {
        return by_uuid(given, uuid, devices);
    }
    if let Some(device) = given
        .parse()
        .ok()
        .and_then(|index: usize| devices.get(index))
    {
        return Ok(device.clone());
    }
    let matching = |matches: &dyn Fn(&str) -> bool| -> Vec<&Device> {
        devices
            .iter()
            .filter(|device| matches(&device.name().to_lowercase()))
            .collect()
    };
    let whole = matching(&|name| name == part);
    let found = if whole.is_empty() {
        matching(&|name| name.contains(&part))
    } else {
        whole
    };
    let list = listing(devices);
    match *found {
        [one] => Ok(one.clone()),
        [] => {
            let known = devices
                .iter()
                .map(Device::name)
                .chain(["auto", "first", "cpu", "vulkan"]);
            let hint = words::nearest(given, known)
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_default();
            let message = format!("there is no device `{given}`{hint}");
            Err(Failure::usage(message).with_lines(list))
        }
        _ => Err(Failure::usage(format!(
            "`{given}` could be several devices; give more of the name, or the index"
        ))
        .with_lines(list)),
    }
}

/// The device of a UUID, with or without its dashes and NVIDIA's `GPU-` before it.
fn by_uuid(given: &str, uuid: &str, devices: &[Device]) -> Result<Device, Failure> {
    let digits = |text: &str| text.replace('-', "");
    let wanted = digits(uuid.strip_prefix("gpu-").unwrap_or(uuid));
    let own = |device: &&Device| device.uuid().is_some_and(|own| digits(&own) == wanted);
    match devices.iter().find(own) {
        Some(device) => Ok(device.clone()),
        None => {
            let lines = devices.iter().map(|device| {
                let uuid = device.uuid().unwrap_or_default();
                format!("  uuid:{uuid}  {}", device.name())
            });
            let message = format!("there is no device `{given}`; there are");
            Err(Failure::usage(message).with_lines(lines))
        }
    }
}

fn listing(devices: &[Device]) -> Vec<String> {
    let lines = devices.iter().enumerate();
    let lines = lines.map(|(index, device)| format!("  {index}  {}", device.name()));
    std::iter::once("  there are: auto, first, cpu, vulkan, and".to_owned())
        .chain(lines)
        .collect()
}
