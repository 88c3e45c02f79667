//! Drawing of an arm: home pose, workspace and paths from the side and from above, and the ranges of its joints.

use core::fmt::Write as _;
use supple_cli::exit::Failure;
use supple_core::dynamics::{joint_poses, tip_pose};
use supple_core::nalgebra::Vector3;
use supple_core::{Trajectory, Vector};
use supple_model::{Description, reach};

/// Poses whose tips show the workspace.
const POSES: u32 = 1500;
/// Width and height of a view, and its margin \[px\].
const VIEW_PX: (f64, f64) = (380.0, 380.0);
const MARGIN_PX: f64 = 30.0;
/// Height of a joint's row \[px\].
const ROW_PX: f64 = 22.0;
/// Speed of the drawn quadrant \[m/s\].
const SPEED_M_PER_S: f64 = 0.06;

/// Axes of a view: horizontal and vertical coordinate of a point.
type View = fn(&Vector3<f64>, &Vector3<f64>) -> (f64, f64);

/// The drawing as SVG.
///
/// # Errors
/// If the arm does not have `N` joints.
pub fn svg<const N: usize>(arm: &Description) -> Result<String, Failure> {
    let config = arm.config::<N>()?;
    let home: Vector<N> = arm.home::<N>()?;
    let outward = arm.paths().outward();
    let mut skeleton = vec![Vector3::zeros()];
    let poses = joint_poses(&config.arm, &home);
    skeleton.extend(poses.iter().map(|pose| pose.translation));
    skeleton.push(tip_pose(&config.arm, &home).translation);
    let cloud: Vec<Vector3<f64>> = reach::spread_poses(&config, POSES)
        .map(|q| {
            let q = Vector::from_fn(|i, _| match config.roles[i] {
                supple_core::config::Role::Held { position_rad, .. } => position_rad,
                supple_core::config::Role::Active => q[i],
            });
            tip_pose(&config.arm, &q).translation
        })
        .collect();
    let (sinusoid, _) = arm.paths().sinusoid(1.0);
    let (quadrant, quadrant_s) = arm.paths().quadrant(SPEED_M_PER_S);
    let paths = [
        sampled(&sinusoid, 12.0),
        sampled(&Trajectory::Quadrant(quadrant), 0.5 * quadrant_s + 0.5),
    ];
    let height = VIEW_PX.1 + 60.0 + ROW_PX * N as f64 + 20.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{height}\" viewBox=\"0 0 {0} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\" role=\"img\" aria-label=\"home pose, workspace and joint limits of {1}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        2.0 * VIEW_PX.0,
        escaped(arm.name())
    );
    let side: View = |point, outward| (point.dot(outward), point.z);
    let above: View = |point, _| (point.x, point.y);
    for (index, (title, view)) in [("from the side [m]", side), ("from above [m]", above)]
        .iter()
        .enumerate()
    {
        let origin = (index as f64 * VIEW_PX.0, 0.0);
        let points = |list: &[Vector3<f64>]| -> Vec<(f64, f64)> {
            list.iter().map(|point| view(point, &outward)).collect()
        };
        draw_view(
            &mut svg,
            origin,
            title,
            &points(&cloud),
            &points(&skeleton),
            &paths.each_ref().map(|path| points(path)),
        );
    }
    let limits = &config.limits;
    for (i, name) in arm.joint_names().iter().enumerate() {
        let y = VIEW_PX.1 + 50.0 + ROW_PX * i as f64;
        let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
        let x = |angle: f64| 260.0 + 320.0 * (angle - lower) / (upper - lower);
        let role = match config.roles[i] {
            supple_core::config::Role::Active => "active",
            supple_core::config::Role::Held { .. } => "held",
        };
        let _ = writeln!(
            svg,
            "<text x=\"20\" y=\"{0}\">{1} ({role})</text><text x=\"250\" y=\"{0}\" text-anchor=\"end\">{lower:.2}</text>\
             <rect x=\"260\" y=\"{2}\" width=\"320\" height=\"6\" fill=\"#dddddd\"/>\
             <circle cx=\"{3:.1}\" cy=\"{4}\" r=\"5\" fill=\"#1f5fa8\"/>\
             <text x=\"590\" y=\"{0}\">{upper:.2} rad, {5} N m, {6} rad/s</text>",
            y + 4.0,
            escaped(name),
            y - 3.0,
            x(home[i]),
            y,
            limits.joint_torque_nm[i],
            limits.joint_speed_rad_per_s[i],
        );
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

fn sampled(trajectory: &Trajectory, duration_s: f64) -> Vec<Vector3<f64>> {
    let times = (0..=200).map(|k| duration_s * f64::from(k) / 200.0);
    times.map(|time_s| trajectory.at(time_s).position).collect()
}

fn draw_view(
    svg: &mut String,
    (left, top): (f64, f64),
    title: &str,
    cloud: &[(f64, f64)],
    skeleton: &[(f64, f64)],
    paths: &[Vec<(f64, f64)>; 2],
) {
    let all = || cloud.iter().chain(skeleton).chain(paths.iter().flatten());
    let range = |of: fn(&(f64, f64)) -> f64| {
        let values = || all().map(of);
        (
            values().fold(f64::MAX, f64::min),
            values().fold(f64::MIN, f64::max),
        )
    };
    let ((x0, x1), (y0, y1)) = (range(|p| p.0), range(|p| p.1));
    let size = (x1 - x0).max(y1 - y0).max(1e-3);
    let scale = (VIEW_PX.0 - 2.0 * MARGIN_PX) / size;
    let place = |p: &(f64, f64)| {
        (
            left + 0.5 * VIEW_PX.0 + scale * (p.0 - 0.5 * (x0 + x1)),
            top + 0.5 * VIEW_PX.1 - scale * (p.1 - 0.5 * (y0 + y1)),
        )
    };
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" font-weight=\"bold\">{title}</text>",
        left + 20.0,
        top + 18.0
    );
    for point in cloud {
        let (x, y) = place(point);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1\" fill=\"#c9d7e8\"/>"
        );
    }
    let line = |points: &[(f64, f64)], colour: &str, width: f64| {
        let points: Vec<String> = points
            .iter()
            .map(place)
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"/>\n",
            points.join(" ")
        )
    };
    svg.push_str(&line(skeleton, "#444444", 5.0));
    svg.push_str(&line(&paths[0], "#c03a2b", 2.5));
    svg.push_str(&line(&paths[1], "#2b8a3e", 1.5));
    for joint in skeleton {
        let (x, y) = place(joint);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"white\" stroke=\"#444444\" stroke-width=\"2\"/>"
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\">{:.2} m</text><line x1=\"{}\" y1=\"{1}\" x2=\"{}\" y2=\"{1}\" stroke=\"black\"/>",
        left + 25.0 + 0.1 * size * scale,
        top + VIEW_PX.1 - 6.0,
        0.1 * size,
        left + 20.0,
        left + 20.0 + 0.1 * size * scale,
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
