//! Scenes from TOML, and rejection of invalid scenes.

use crate::common::{self, wam4};
use supple_core::Vector;
use supple_core::nalgebra::Vector3;
use supple_plant::{ObjectKind, Plant, PlantConfig, Scene, SceneError};

const TABLE: &str = r#"
[ground]
height_m = -0.35
material = "wood"

[[fixed_block]]
name = "table"
center_m = [0.70, 0.0, -0.05]
size_m = [0.30, 0.60, 0.10]
rpy_rad = [0.0, 0.0, 0.5]
material = "acrylic"
layer = { thickness_m = 0.008, material = "rubber" }

[[free_box]]
name = "carton"
mass_kg = 2.0
center_m = [0.40, 0.5, -0.25]
size_m = [0.10, 0.10, 0.20]
material = "wood"

[[material]]
name = "acrylic"
stiffness_n_per_m_1_5 = 3e8
dissipation_s_per_m = 20.0
friction = 0.25

[[material]]
name = "wood"
stiffness_n_per_m_1_5 = 1e8
dissipation_s_per_m = 30.0
friction = 0.4
"#;

#[test]
fn a_scene_written_as_toml_is_read_back_unchanged() {
    let scene = Scene::from_toml(TABLE, "table.toml").unwrap();
    assert_eq!(
        scene.material("wood").unwrap().friction,
        0.4,
        "the material of the scene takes precedence"
    );
    assert_eq!(scene.material("rubber").unwrap().stiffness_n_per_m_1_5, 4e6);
    let text = toml::to_string(&scene).unwrap();
    assert_eq!(Scene::from_toml(&text, "again").unwrap(), scene);
    assert_eq!(Scene::from_toml("", "empty").unwrap(), Scene::default());
}

#[test]
fn objects_have_the_poses_of_the_scene() {
    let config = PlantConfig {
        scene: Scene::from_toml(TABLE, "table.toml").unwrap(),
        ..PlantConfig::ideal(wam4())
    };
    let plant = Plant::new(config, Vector::zeros(), Vector::zeros()).unwrap();
    let objects: Vec<_> = plant.objects().collect();
    let kinds: Vec<_> = objects.iter().map(|o| o.kind).collect();
    use ObjectKind::{FixedBlock, FreeBox, Ground, Layer};
    assert_eq!(kinds, [Ground, FixedBlock, Layer, FreeBox]);
    let near = |a: Vector3<f64>, b: [f64; 3]| (a - Vector3::from(b)).norm() < 1e-12;
    assert!(near(objects[0].pose.translation, [0.0, 0.0, -0.35]));
    assert!(near(objects[1].pose.translation, [0.7, 0.0, -0.05]));
    assert!((objects[1].pose.rotation[(1, 0)] - 0.5_f64.sin()).abs() < 1e-12);
    assert!(near(objects[2].pose.translation, [0.7, 0.0, 0.004]));
    assert!(near(objects[2].size_m, [0.3, 0.6, 0.008]));
    assert_eq!(objects[2].material, "rubber");
    assert_eq!(objects[3].name, "carton");
}

#[test]
fn bad_scenes_are_rejected_with_element_field_value_and_remedy() {
    let error_of = |from: &str, to: &str| -> String {
        assert!(TABLE.contains(from), "{from}");
        let text = TABLE.replacen(from, to, 1);
        Scene::from_toml(&text, "table.toml")
            .unwrap_err()
            .to_string()
    };
    let assert_contains = |text: String, words: &[&str]| {
        assert!(words.iter().all(|w| text.contains(w)), "{text}");
    };
    assert_contains(
        error_of("height_m", "hight_m"),
        &["table.toml", "hight_m", "height_m"],
    );
    assert_contains(
        error_of("mass_kg = 2.0", "mass_kg = -2.0"),
        &["free_box \"carton\"", "mass_kg", "-2", "positive"],
    );
    assert_contains(
        error_of("0.60, 0.10]", "0.0, 0.10]"),
        &["fixed_block \"table\"", "size_m", "is 0", "positive"],
    );
    assert_contains(
        error_of("0.0, 0.5]", "0.0, nan]"),
        &["fixed_block \"table\"", "rpy_rad", "NaN", "finite"],
    );
    assert_contains(
        error_of("0.008", "0.0"),
        &["fixed_block \"table\"", "layer.thickness_m", "positive"],
    );
    assert_contains(
        error_of("material = \"rubber\"", "material = \"jelly\""),
        &["jelly", "use one of", "\"acrylic\"", "[[material]]"],
    );
    assert_contains(
        error_of("friction = 0.25", "friction = -0.25"),
        &["material \"acrylic\"", "friction", "-0.25"],
    );
    assert_contains(
        error_of("3e8", "inf"),
        &["material \"acrylic\"", "stiffness_n_per_m_1_5", "inf"],
    );
    assert_contains(
        error_of("\"carton\"", "\"table\""),
        &["\"table\"", "rename"],
    );
    assert_contains(
        error_of("[0.70, 0.0, -0.05]", "[0.70, 0.0]"),
        &["table.toml", "center_m"],
    );
}

#[test]
fn a_box_in_the_ground_and_a_tip_in_a_block_are_rejected() {
    let sunk = TABLE.replacen("-0.25]", "-0.26]", 1);
    let text = Scene::from_toml(&sunk, "table.toml")
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("carton") && text.contains("-0.26") && text.contains("ground"),
        "{text}"
    );

    let arm = wam4();
    let config = PlantConfig {
        scene: common::block(),
        ..PlantConfig::ideal(arm)
    };
    let buried = common::wam4_at(&arm, 0.72, 0.015);
    let error = Plant::new(config.clone(), buried, Vector::zeros())
        .err()
        .unwrap();
    let text = error.to_string();
    assert!(
        text.contains("0.005") && text.contains("\"block\"") && text.contains("start pose"),
        "{text}"
    );
    let above = common::wam4_at(&arm, 0.72, 0.021);
    let mut plant = Plant::new(config, above, Vector::zeros()).unwrap();
    assert!(plant.set_state(buried, Vector::zeros()).is_err());
}

#[test]
fn a_plant_rejects_a_bad_scene_built_in_code() {
    let mut scene = common::block();
    scene.fixed_blocks[0].material = "jelly".to_owned();
    let config = PlantConfig {
        scene,
        ..PlantConfig::ideal(wam4())
    };
    let error = Plant::new(config, Vector::zeros(), Vector::zeros())
        .err()
        .unwrap();
    assert!(matches!(
        error,
        supple_plant::PlantError::Scene(SceneError::UnknownMaterial { .. })
    ));
}
