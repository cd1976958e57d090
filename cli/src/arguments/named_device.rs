//! Finds the device that `--device` names among those that `tumble devices` lists.

use tumble::Device;
use tumble::vulkan::VulkanError;

use crate::messages::exit::Failure;
use crate::messages::words;

/// The device of that index, else of that name, else of a name that contains the text (a card's name may
/// be a number). After `uuid:` stands the UUID that Vulkan reports, by which other programs know the card.
pub(super) fn named(requested: &str, devices: &[Device]) -> Result<Device, Failure> {
    if devices.is_empty() {
        return Err(Failure::no_vulkan(&VulkanError::NoDevice));
    }
    let part = requested.to_lowercase();
    if let Some(uuid) = part.strip_prefix("uuid:") {
        return by_uuid(requested, uuid, devices);
    }
    if let Some(device) = requested
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
            let hint = words::nearest(requested, known)
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_default();
            let message = format!("there is no device `{requested}`{hint}");
            Err(Failure::usage(message).with_lines(list))
        }
        _ => Err(Failure::usage(format!(
            "`{requested}` could be several devices; give more of the name, or the index"
        ))
        .with_lines(list)),
    }
}

/// The device of a UUID, with or without its dashes and NVIDIA's `GPU-` before it.
fn by_uuid(requested: &str, uuid: &str, devices: &[Device]) -> Result<Device, Failure> {
    let digits = |text: &str| text.replace('-', "");
    let requested_digits = digits(uuid.strip_prefix("gpu-").unwrap_or(uuid));
    let has_uuid = |device: &&Device| {
        device
            .uuid()
            .is_some_and(|known| digits(&known) == requested_digits)
    };
    match devices.iter().find(has_uuid) {
        Some(device) => Ok(device.clone()),
        None => {
            let lines = devices.iter().map(|device| {
                let uuid = device.uuid().unwrap_or_default();
                format!("  uuid:{uuid}  {}", device.name())
            });
            let message = format!("there is no device `{requested}`; there are");
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
