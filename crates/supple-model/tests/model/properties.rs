//! Random chains survive a URDF round trip; mutated files never cause a panic.

use crate::common::{TOML, URDF};
use crate::property::config;
use proptest::prelude::*;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Body, Pose};
use supple_model::Description;

#[derive(Clone, Debug)]
struct RandomJoint {
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
    mass: f64,
    com: [f64; 3],
    com_rpy: [f64; 3],
    /// Mean square extents: any three positive values are physically consistent.
    extents: [f64; 3],
}

impl RandomJoint {
    fn inertia(&self) -> [f64; 3] {
        let [x, y, z] = self.extents;
        [y + z, x + z, x + y].map(|i| self.mass * i)
    }

    fn body(&self) -> Body {
        Body {
            mass_kg: self.mass,
            com_m: Vector3::zeros(),
            inertia_kg_m2: Matrix3::from_diagonal(&Vector3::from(self.inertia())),
        }
        .expressed_in(&Pose::from_xyz_rpy(self.com, self.com_rpy))
    }

    fn urdf(&self, i: usize) -> String {
        let words = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        let [ixx, iyy, izz] = self.inertia();
        format!(
            "<link name=\"l{next}\"><inertial><origin xyz=\"{com}\" rpy=\"{com_rpy}\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" iyy=\"{iyy}\" iyz=\"0\" izz=\"{izz}\"/></inertial></link>\
             <joint name=\"j{i}\" type=\"revolute\"><parent link=\"l{i}\"/><child link=\"l{next}\"/>\
             <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"{axis}\"/>\
             <limit lower=\"-3\" upper=\"3\" effort=\"10\" velocity=\"2\"/></joint>",
            next = i + 1,
            com = words(self.com),
            com_rpy = words(self.com_rpy),
            mass = self.mass,
            xyz = words(self.xyz),
            rpy = words(self.rpy),
            axis = words(self.axis),
        )
    }
}

fn triple(range: core::ops::Range<f64>) -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(range)
}

fn joint() -> impl Strategy<Value = RandomJoint> {
    let axis = triple(-1.0..1.0).prop_filter("a direction", |a| a.iter().any(|x| x.abs() > 0.1));
    (
        triple(-1.0..1.0),
        triple(-3.0..3.0),
        axis,
        0.1..9.0,
        triple(-0.3..0.3),
        triple(-3.0..3.0),
        triple(1e-4..0.1),
    )
        .prop_map(
            |(xyz, rpy, axis, mass, com, com_rpy, extents)| RandomJoint {
                xyz,
                rpy,
                axis,
                mass,
                com,
                com_rpy,
                extents,
            },
        )
}

const MINIMAL: &str = "name = \"random\"\nurdf = \"random.urdf\"\ntip_frame = \"l4\"\n";

fn chain(joints: &[RandomJoint]) -> String {
    let body: String = joints
        .iter()
        .enumerate()
        .map(|(i, joint)| joint.urdf(i))
        .collect();
    format!("<robot name=\"random\"><link name=\"l0\"/>{body}</robot>")
}

proptest! {
    #![proptest_config(config(200, 20_260_202))]

    #[test]
    fn a_written_chain_is_read_back(joints in prop::collection::vec(joint(), 4)) {
        let parts = Description::from_text(MINIMAL, &chain(&joints)).unwrap().parts::<4>().unwrap();
        for (found, joint) in parts.joints.iter().zip(&joints) {
            prop_assert_eq!(found.parent_from_link, Pose::from_xyz_rpy(joint.xyz, joint.rpy));
            let axis = Vector3::from(joint.axis);
            prop_assert!((found.axis - axis / axis.norm()).amax() < 1e-15);
            let body = joint.body();
            prop_assert_eq!(found.body.mass_kg, body.mass_kg);
            prop_assert!((found.body.com_m - body.com_m).amax() < 1e-15);
            prop_assert!((found.body.inertia_kg_m2 - body.inertia_kg_m2).amax() < 1e-14);
        }
    }

    /// A link that is split in two parts with a fixed joint between them is the same link.
    #[test]
    fn parts_with_a_fixed_joint_are_one_body(joints in prop::collection::vec(joint(), 4), part in joint(), which in 0..4_usize) {
        let whole = chain(&joints);
        let body = joints[which].body();
        let weld = part
            .urdf(9)
            .replace("\"l10\"", "\"part\"")
            .replace("link=\"l9\"", &format!("link=\"l{}\"", which + 1))
            .replace("type=\"revolute\"", "type=\"fixed\"");
        let cut = whole.replace("</robot>", &format!("{weld}</robot>"));
        let expected = body.merged(&part.body().expressed_in(&Pose::from_xyz_rpy(part.xyz, part.rpy)));
        let found = Description::from_text(MINIMAL, &cut).unwrap().parts::<4>().unwrap().joints[which].body;
        prop_assert!((found.mass_kg - expected.mass_kg).abs() < 1e-12);
        prop_assert!((found.com_m - expected.com_m).amax() < 1e-12);
        prop_assert!((found.inertia_kg_m2 - expected.inertia_kg_m2).amax() < 1e-12);
    }
}

/// The text with one part replaced by a typical fragment of such files, or removed.
fn mutated(text: &'static str) -> impl Strategy<Value = String> {
    let words = prop::sample::select(vec![
        "", "0", "-1", "1e308", "nan", "inf", "\"", "<", ">", "/", "[", "]", "=", "<link/>",
        "base", "tip", "\u{e9}", "{", "}", "-0.0", "1e-320", "revolute", "mimic",
    ]);
    (0..text.len(), 0..40_usize, words).prop_map(move |(start, length, word)| {
        let end = (start + length).min(text.len());
        format!("{}{word}{}", &text[..start], &text[end..])
    })
}

proptest! {
    #![proptest_config(config(2000, 20_260_203))]

    /// The text is either rejected, or gives a usable description.
    #[test]
    fn a_damaged_urdf_does_not_panic(urdf in mutated(URDF)) {
        if let Ok(description) = Description::from_text(TOML, &urdf) {
            usable(&description);
        }
    }

    #[test]
    fn a_damaged_toml_does_not_panic(toml in mutated(TOML)) {
        if let Ok(description) = Description::from_text(&toml, URDF) {
            usable(&description);
        }
    }
}

fn usable(description: &Description) {
    let used = supple_model::with_dof!(description.dof(), N => {
        let Ok(config) = description.config::<N>() else {
            return;
        };
        assert!(config.arm.armature().iter().all(|x| x.is_finite()));
        let home = description.home::<N>().unwrap();
        let gravity = supple_core::dynamics::gravity(&config.arm, &home);
        assert!(gravity.iter().all(|x| x.is_finite()), "{gravity}");
    });
    drop(used);
}
