//! The public interface of the crate `tumble`, by the description that rustdoc writes as JSON: traits of types, structs
//! and enums that can grow, and no flags among arguments.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Enums that other crates may match without a default, and why they get no more variants.
const CLOSED_ENUMS: &[(&str, &str)] = &[
    ("Axes", "a rotation has a body and a parent"),
    (
        "Channel",
        "a transform is a translation, a rotation and a scale",
    ),
    (
        "ComponentType",
        "who writes arrays must know every type of number",
    ),
    ("KeySigns", "a sign is changed or kept"),
    ("Layout", "a result has two axes, in one order or the other"),
    ("MatrixOrder", "a matrix has rows and columns"),
    ("PerTrack", "one for all, or one for each"),
    ("paths::Twist", "what is left over is spread or kept"),
    (
        "reference::FollowerDirection",
        "the reference is stated in full",
    ),
    (
        "reference::FollowerFrame",
        "the reference is stated in full",
    ),
    (
        "reference::FollowerSpeed",
        "the reference is stated in full",
    ),
    ("trees::BodyOrder", "who reads robots must know every order"),
    ("trees::BodyRows", "rows or arrays"),
    ("trees::JointKind", "who reads robots must treat every kind"),
    ("trees::Siblings", "who reads robots must know every order"),
];

/// Structs that other crates may write as literals, and why they get no more fields.
const CLOSED_STRUCTS: &[(&str, &str)] = &[
    ("Tcb", "tension, continuity and bias"),
    (
        "Transforms",
        "a transform is a translation, a rotation and a scale",
    ),
    ("VectorKeys", "times, keys and tangents"),
    (
        "crowd::BodyStates",
        "memory of the caller, with a default for every part",
    ),
    ("crowd::FrameStep", "two ticks and their distance"),
    ("crowd::MotionClip", "all that a clip is prepared of"),
    (
        "crowd::MotionStates",
        "memory of the caller, with a default for every part",
    ),
    (
        "crowd::MotionWords",
        "the words of a file, all of which are needed",
    ),
    ("reference::Follower", "the reference is stated in full"),
    ("reference::VectorCurve", "the reference is stated in full"),
    (
        "trees::BodyArrays",
        "memory of the caller, with a default for every part",
    ),
    ("trees::BodyMotion", "a pose and its velocity"),
    ("trees::BodyPose", "a rotation and a position"),
    ("trees::BodyVelocity", "two velocities"),
    (
        "trees::Configuration",
        "a reader of robots must state every value",
    ),
    (
        "trees::ConfigurationRates",
        "a reader of robots must state every value",
    ),
    (
        "trees::JointCounts",
        "the degrees of freedom of the kinds of joints",
    ),
    (
        "trees::FrameWords",
        "the words of a file, all of which are needed",
    ),
    (
        "trees::JointTracks",
        "a reader of robots must state every track",
    ),
    ("trees::Mimic", "a reader of robots must state every value"),
    (
        "trees::TreeBody",
        "a reader of robots must state every value",
    ),
    (
        "trees::TreeJoint",
        "a reader of robots must state every value",
    ),
    (
        "vulkan::SelfTestReport",
        "tests of programs compose reports",
    ),
    ("vulkan::tuning::RunLanes", "a number for each class"),
];

/// Errors that other crates may write as literals, and why they get no fields.
const CLOSED_ERRORS: &[(&str, &str)] = &[("StoppedError", "the work was stopped, and that is all")];

/// Types that are not cloned, and why.
const NOT_CLONED: &[(&str, &str)] = &[
    ("Chunk", "it lends the memory of a stream"),
    (
        "Clip",
        "it is large and stays on its device; share it by reference or `Arc`",
    ),
    ("OutputBuffer", "it is large memory"),
    ("Samples", "it is large memory; copy its slice"),
    ("Transforms", "it has samples"),
    ("crowd::BodyStates", "it lends memory of the caller"),
    ("crowd::Crowd", "it is on its device"),
    ("crowd::DeviceBodies", "it is on its device"),
    ("crowd::DeviceMotions", "it is on its device"),
    ("crowd::MappedStates", "it is memory of its device"),
    ("crowd::MotionStates", "it lends memory of the caller"),
    ("paths::Followed", "it has samples"),
    ("reference::FollowerWalk", "it steps along a path"),
    ("reference::ReferenceCurve", "it is made of functions"),
    ("trees::BodyArrays", "it lends memory of the caller"),
    ("trees::BodyRows", "it lends memory of the caller"),
    ("vulkan::ClipTarget", "it owns objects of Vulkan"),
    ("vulkan::CrowdTarget", "it owns objects of Vulkan"),
    ("vulkan::TimedTarget", "it owns objects of Vulkan"),
    ("vulkan::PassTarget", "it owns objects of Vulkan"),
];

/// Types that stay on their thread, and why.
const OF_ONE_THREAD: &[(&str, &str)] = &[("reference::FollowerWalk", "it borrows functions")];

/// Arguments that are flags, and why.
const FLAGS: &[(&str, &str)] = &[];

/// The description of the interface, with default features.
struct Interface {
    items: BTreeMap<String, Value>,
    /// Types by their paths below the crate.
    types: BTreeMap<String, Value>,
    functions: BTreeMap<String, Value>,
}

impl Interface {
    /// Lets rustdoc describe the crate; its dependencies are only checked.
    fn of_crate() -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let output = Command::new(env!("CARGO"))
            .args(["rustdoc", "--quiet", "-p", "tumble", "--lib", "--"])
            .args(["-Z", "unstable-options", "--output-format", "json"])
            .env("RUSTDOC", folder.join("scripts/rustdoc.sh"))
            .current_dir(&folder)
            .output()
            .unwrap();
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words}");
        let target = std::env::var_os("CARGO_TARGET_DIR");
        let target = target.map_or_else(|| folder.join("target"), Into::into);
        let text = fs::read_to_string(target.join("doc/tumble.json")).unwrap();
        let mut all: Value = serde_json::from_str(&text).unwrap();
        let Value::Object(items) = all["index"].take() else {
            panic!("rustdoc's JSON has no index");
        };
        let mut found = Self {
            items: items.into_iter().collect(),
            types: BTreeMap::new(),
            functions: BTreeMap::new(),
        };
        found.walk(&all["root"], "");
        found
    }

    fn item(&self, id: &Value) -> Option<&Value> {
        self.items.get(&id.to_string())
    }

    /// The kind of an item, and what it is.
    fn inner(item: &Value) -> (&str, &Value) {
        let inner = item["inner"].as_object().and_then(|one| one.iter().next());
        inner.map_or(("", &Value::Null), |(kind, inner)| (kind, inner))
    }

    /// Lists a module's types and functions, those that it exports from other modules of the crate among them.
    fn walk(&mut self, id: &Value, path: &str) {
        let Some(item) = self.item(id).cloned() else {
            return; // of another crate
        };
        let within = |name: &Value| match (path, name.as_str().unwrap_or_default()) {
            ("", name) => name.to_owned(),
            (path, name) => format!("{path}::{name}"),
        };
        let (kind, inner) = Self::inner(&item);
        match kind {
            "module" => {
                let is_crate = inner["is_crate"] == true;
                let path = if is_crate {
                    String::new()
                } else {
                    within(&item["name"])
                };
                for id in inner["items"].as_array().unwrap() {
                    self.walk(id, &path);
                }
            }
            "use" => {
                let Some(target) = self.item(&inner["id"]).cloned() else {
                    return;
                };
                assert!(Self::inner(&target).0 != "module", "{}", inner["name"]);
                self.list(within(&inner["name"]), target);
            }
            _ => self.list(within(&item["name"]), item.clone()),
        }
    }

    fn list(&mut self, path: String, item: Value) {
        match Self::inner(&item).0 {
            "struct" | "enum" => drop(self.types.insert(path, item)),
            "function" => drop(self.functions.insert(path, item)),
            _ => {}
        }
    }

    /// The implementations of a type, those for all types left out.
    fn implementations(&self, item: &Value) -> impl Iterator<Item = &Value> {
        let all = Self::inner(item).1["impls"].as_array().unwrap();
        let all: Vec<&Value> = all.iter().filter_map(|id| self.item(id)).collect();
        all.into_iter()
            .map(|item| &item["inner"]["impl"])
            .filter(|one| one["blanket_impl"].is_null() && one["is_negative"] == false)
    }

    fn traits(&self, item: &Value) -> BTreeSet<String> {
        let paths = self
            .implementations(item)
            .filter_map(|one| one["trait"]["path"].as_str());
        let last = |path: &str| path.rsplit("::").next().unwrap_or(path).to_owned();
        paths.map(last).collect()
    }

    /// Every function and every method of a type, by its path.
    fn all_functions(&self) -> Vec<(String, &Value)> {
        let mut all: Vec<(String, &Value)> = Vec::new();
        for (path, item) in &self.types {
            for one in self
                .implementations(item)
                .filter(|one| one["trait"].is_null())
            {
                for item in one["items"].as_array().unwrap() {
                    let item = self
                        .item(item)
                        .filter(|item| Self::inner(item).0 == "function");
                    all.extend(item.map(|item| (format!("{path}::{}", text(&item["name"])), item)));
                }
            }
        }
        all.extend(
            self.functions
                .iter()
                .map(|(path, item)| (path.clone(), item)),
        );
        all
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn is_non_exhaustive(item: &Value) -> bool {
    item["attrs"].to_string().contains("non_exhaustive")
}

/// Whether other crates can write all fields of a struct.
fn is_open(inner: &Value) -> bool {
    let (plain, tuple) = (&inner["kind"]["plain"], &inner["kind"]["tuple"]);
    let has_all = |fields: &Value| fields.as_array().is_some_and(|all| !all.is_empty());
    has_all(&plain["fields"]) && plain["has_stripped_fields"] == false
        || has_all(tuple)
            && tuple
                .as_array()
                .unwrap()
                .iter()
                .all(|field| !field.is_null())
}

/// Whether a type is `bool`, or holds one; functions that are passed may return one.
fn contains_flag(of_argument: &Value) -> bool {
    match of_argument {
        Value::Object(parts) if parts.contains_key("parenthesized") => false,
        Value::Object(parts) if parts.contains_key("function_pointer") => false,
        Value::Object(parts) => {
            parts.get("primitive").is_some_and(|name| name == "bool")
                || parts.values().any(contains_flag)
        }
        Value::Array(parts) => parts.iter().any(contains_flag),
        _ => false,
    }
}

/// Compares what breaks a rule with the list of its exceptions, which are all needed.
fn assert_exceptions(rule: &str, found: BTreeSet<String>, exceptions: &[(&str, &str)]) {
    let listed: BTreeSet<String> = exceptions
        .iter()
        .map(|(path, _)| (*path).to_owned())
        .collect();
    let missing: Vec<&String> = found.difference(&listed).collect();
    assert!(missing.is_empty(), "{rule}: {missing:?}");
    let unused: Vec<&String> = listed.difference(&found).collect();
    assert!(
        unused.is_empty(),
        "{rule}; these exceptions are not needed: {unused:?}"
    );
}

#[test]
fn the_public_interface_can_grow_and_its_types_have_the_usual_traits() {
    let interface = Interface::of_crate();
    assert!(interface.types.len() > 120, "{}", interface.types.len());
    let with = |is_refused: &dyn Fn(&str, &Value, &BTreeSet<String>) -> bool| -> BTreeSet<String> {
        let refused = interface.types.iter().filter(|(_, item)| {
            is_refused(Interface::inner(item).0, item, &interface.traits(item))
        });
        refused.map(|(path, _)| path.clone()).collect()
    };
    let lacks =
        |traits: &BTreeSet<String>, all: &[&str]| all.iter().any(|one| !traits.contains(*one));

    let found = with(&|_, _, traits| lacks(traits, &["Debug"]));
    assert_exceptions("types can be printed (Debug)", found, &[]);
    let found = with(&|_, _, traits| lacks(traits, &["Clone"]));
    assert_exceptions("types can be cloned", found, NOT_CLONED);
    let found = with(&|_, _, traits| lacks(traits, &["Send", "Sync"]));
    assert_exceptions("types can go to other threads", found, OF_ONE_THREAD);

    let of_errors = ["Clone", "PartialEq", "Send", "Sync", "Display"];
    let found = with(&|_, _, traits| traits.contains("Error") && lacks(traits, &of_errors));
    assert_exceptions("errors are cloned, compared and sent", found, &[]);
    let found = with(&|_, item, traits| traits.contains("Error") && !is_non_exhaustive(item));
    assert_exceptions("errors can grow (#[non_exhaustive])", found, CLOSED_ERRORS);
    assert!(with(&|_, _, traits| traits.contains("Error")).len() > 15);

    let found = with(&|kind, item, traits| {
        let variants = Interface::inner(item).1["variants"].as_array();
        let is_plain = |id| {
            interface
                .item(id)
                .is_some_and(|one| one["inner"]["variant"]["kind"] == "plain")
        };
        kind == "enum"
            && variants.is_some_and(|all| all.iter().all(is_plain))
            && !traits.contains("Error")
            && lacks(traits, &["Copy", "Eq", "Hash"])
    });
    assert_exceptions(
        "enums without data are copied, compared and hashed",
        found,
        &[],
    );

    let found = with(&|kind, item, _| kind == "enum" && !is_non_exhaustive(item));
    assert_exceptions("enums can grow (#[non_exhaustive])", found, CLOSED_ENUMS);
    let found = with(&|kind, item, _| {
        kind == "struct" && is_open(Interface::inner(item).1) && !is_non_exhaustive(item)
    });
    assert_exceptions(
        "structs can grow (#[non_exhaustive])",
        found,
        CLOSED_STRUCTS,
    );

    let functions = interface.all_functions();
    assert!(functions.len() > 250, "{}", functions.len());
    let mut found = BTreeSet::new();
    for (path, item) in functions {
        for argument in item["inner"]["function"]["sig"]["inputs"]
            .as_array()
            .unwrap()
        {
            if contains_flag(&argument[1]) {
                found.insert(format!("{path}({})", text(&argument[0])));
            }
        }
    }
    assert_exceptions("arguments say what they mean: no bool", found, FLAGS);
}

/// The rules find what they are for.
#[test]
fn flags_and_open_structs_are_recognised() {
    let json = |text| serde_json::from_str::<Value>(text).unwrap();
    for (argument, is_flag) in [
        (r#"{"primitive": "bool"}"#, true),
        (r#"{"primitive": "u32"}"#, false),
        (
            r#"{"resolved_path": {"path": "Option", "args": {"angle_bracketed": {"args": [{"type": {"primitive": "bool"}}]}}}}"#,
            true,
        ),
        (
            r#"{"impl_trait": [{"trait_bound": {"trait": {"path": "Fn", "args": {"parenthesized": {"inputs": [], "output": {"primitive": "bool"}}}}}}]}"#,
            false,
        ),
    ] {
        assert_eq!(contains_flag(&json(argument)), is_flag, "{argument}");
    }
    for (inner, is_open_struct) in [
        (
            r#"{"kind": {"plain": {"fields": [1, 2], "has_stripped_fields": false}}}"#,
            true,
        ),
        (
            r#"{"kind": {"plain": {"fields": [1], "has_stripped_fields": true}}}"#,
            false,
        ),
        (
            r#"{"kind": {"plain": {"fields": [], "has_stripped_fields": false}}}"#,
            false,
        ),
        (r#"{"kind": {"tuple": [1]}}"#, true),
        (r#"{"kind": {"tuple": [1, null]}}"#, false),
        (r#"{"kind": "unit"}"#, false),
    ] {
        assert_eq!(is_open(&json(inner)), is_open_struct, "{inner}");
    }
}
