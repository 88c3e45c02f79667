//! Message definitions in `ros2msg`: the text of a type, followed by the text of every type that it uses.

use crate::definition::{self, Kind};
use crate::record;
use std::borrow::Cow;

/// Name and fields of every type that is not derived from the record; `[N]` stands for the number of joints.
const TYPES: [(&str, &str); 13] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("std_msgs/String", "string data\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Quaternion",
        "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    ),
    (
        "geometry_msgs/WrenchStamped",
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
         float64[] effort\n",
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "supple_msgs/CycleTiming",
        include_str!("../msg/CycleTiming.msg"),
    ),
    (
        "supple_msgs/PlantTruth",
        include_str!("../msg/PlantTruth.msg"),
    ),
];

/// Returns the text of the type `name` (`package/Type`) for an arm with `dof` joints.
///
/// # Errors
/// An error if the type, or a type that it uses, is not defined here.
pub(crate) fn text(name: &str, dof: usize) -> Result<String, String> {
    let mut text = String::new();
    let mut names = vec![name.to_owned()];
    let mut next = 0;
    while let Some(name) = names.get(next).cloned() {
        let fields = fields(&name, dof)?;
        if next > 0 {
            text += &format!("{}\nMSG: {name}\n", definition::SEPARATOR);
        }
        text += &fields;
        for field in definition::fields(&name, &fields)? {
            if let Kind::Message(used) = field.kind
                && !names.contains(&used)
            {
                names.push(used);
            }
        }
        next += 1;
    }
    Ok(text)
}

fn fields(name: &str, dof: usize) -> Result<String, String> {
    let fields: Cow<'_, str> = match name {
        "supple_msgs/ControllerState" => record::definition().into(),
        "supple_msgs/TorqueTerms" => record::terms_definition().into(),
        _ => {
            let found = TYPES.iter().find(|(known, _)| *known == name);
            let (_, fields) = found.ok_or_else(|| format!("{name} is not defined"))?;
            (*fields).into()
        }
    };
    Ok(fields.replace("[N]", &format!("[{dof}]")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_defined_with_all_that_it_uses() {
        let names = TYPES.map(|(name, _)| name);
        for name in names.into_iter().chain(["supple_msgs/ControllerState"]) {
            let text = text(name, 4).expect(name);
            assert!(!text.contains("[N]"), "{name}");
            let definitions = definition::parse(name, &text).expect(name);
            definitions.check().expect(name);
        }
    }
}
