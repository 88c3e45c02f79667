//! Drawing of an arm: home pose, workspace and paths from the side and from above, and the ranges of its joints.

use core::fmt::Write as _;
use supple_cli::exit::Failure;
use supple_core::dynamics::{joint_poses, tip_pose};
use supple_core::nalgebra::Vector3;
use supple_core::{Trajectory, Vector};
use supple_model::{Description, reach};

/// Number of poses whose tip positions show the workspace.
const POSES: u32 = 1500;
/// Width and height of a view, and its margin \[px\].
const VIEW_PX: (f64, f64) = (380.0, 380.0);
const MARGIN_PX: f64 = 30.0;
/// Height of a row of text, and maximum width of a letter, of the 12 px font \[px\].
const ROW_PX: f64 = 22.0;
const LETTER_PX: f64 = 7.0;
/// Minimum length of the bar that shows a joint's range \[px\].
const BAR_PX: f64 = 160.0;
/// Distance of text from the border and from neighbouring elements \[px\].
const BORDER_PX: f64 = 20.0;
const GAP_PX: f64 = 10.0;
/// Colours of the workspace, the arm and its joints, the two paths, and the range and the angle at home of a joint.
const WORKSPACE: &str = "#9db8d6";
const ARM: &str = "#444444";
const PATHS: [&str; 2] = ["#c03a2b", "#2b8a3e"];
const RANGE: &str = "#cccccc";
const HOME: &str = "#1f5fa8";
/// Speed of the drawn quadrant \[m/s\].
const SPEED_M_PER_S: f64 = 0.06;

/// Axes of a view: horizontal and vertical coordinate of a point.
type View = fn(&Vector3<f64>, &Vector3<f64>) -> (f64, f64);

/// Draws the arm as SVG.
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
    let rows = rows(arm, &config, &home);
    let widths = [
        |row: &Row| row.name.chars().count(),
        |row: &Row| row.lower.chars().count(),
        |row: &Row| row.upper.chars().count(),
    ]
    .map(|length| LETTER_PX * rows.iter().map(length).max().unwrap_or(0) as f64);
    let beside = 2.0 * BORDER_PX + 3.0 * GAP_PX + widths.iter().sum::<f64>();
    let width = (2.0 * VIEW_PX.0).max(beside + BAR_PX);
    let (legend, legend_rows) = legend(width);
    let first_row = VIEW_PX.1 + ROW_PX * (legend_rows as f64 + 1.0);
    let height = first_row + ROW_PX * N as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\" fill=\"black\" role=\"img\" aria-label=\"home pose, workspace, paths and \
         joint limits of {0}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        escaped(arm.name())
    );
    let side: View = |point, outward| (point.dot(outward), point.z);
    let above: View = |point, _| (point.x, point.y);
    for (index, (title, view)) in [("from the side [m]", side), ("from above [m]", above)]
        .iter()
        .enumerate()
    {
        let origin = ((index as f64 - 1.0) * VIEW_PX.0 + 0.5 * width, 0.0);
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
    svg.push_str(&legend);
    let bar = (
        BORDER_PX + widths[0] + widths[1] + 2.0 * GAP_PX,
        width - beside,
    );
    for (row, y) in rows
        .iter()
        .zip((0..).map(|i| first_row + ROW_PX * f64::from(i)))
    {
        let _ = writeln!(
            svg,
            "<text x=\"{BORDER_PX}\" y=\"{text}\">{}</text><text x=\"{}\" y=\"{text}\" text-anchor=\"end\">{}</text>\
             <rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"6\" fill=\"{RANGE}\"/>\
             <circle cx=\"{:.1}\" cy=\"{y}\" r=\"5\" fill=\"{HOME}\"/><text x=\"{}\" y=\"{text}\">{}</text>",
            escaped(&row.name),
            bar.0 - GAP_PX,
            row.lower,
            bar.0,
            y - 3.0,
            bar.1,
            bar.0 + bar.1 * row.home_share,
            bar.0 + bar.1 + GAP_PX,
            row.upper,
            text = y + 4.0,
        );
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Row of a joint in the drawing.
struct Row {
    name: String,
    lower: String,
    upper: String,
    /// Position of the home angle between the limits, 0 to 1.
    home_share: f64,
}

fn rows<const N: usize>(
    arm: &Description,
    config: &supple_core::Config<N>,
    home: &Vector<N>,
) -> Vec<Row> {
    let limits = &config.limits;
    let row = |i: usize| {
        let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
        let role = match config.roles[i] {
            supple_core::config::Role::Active => "active",
            supple_core::config::Role::Held { .. } => "held",
        };
        Row {
            name: format!("{} ({role})", arm.joint_names()[i]),
            lower: rounded(lower),
            upper: format!(
                "{} rad, {} N m, {} rad/s",
                rounded(upper),
                rounded(limits.joint_torque_nm[i]),
                rounded(limits.joint_speed_rad_per_s[i])
            ),
            home_share: (home[i] - lower) / (upper - lower),
        }
    };
    (0..N).map(row).collect()
}

/// Formats a number with three significant digits or as an integer, without trailing zeros.
fn rounded(value: f64) -> String {
    let digits = 2.0 - value.abs().max(1e-3).log10().floor();
    let text = format!("{value:.*}", digits.clamp(0.0, 5.0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Returns the legend below the views of a drawing of this width, and its number of rows.
fn legend(width: f64) -> (String, usize) {
    let line = |colour: &str| {
        format!("<line x1=\"0\" x2=\"16\" stroke=\"{colour}\" stroke-width=\"2.5\"/>")
    };
    let dot =
        |radius: u8, colour: &str| format!("<circle cx=\"8\" r=\"{radius}\" fill=\"{colour}\"/>");
    let joint =
        format!("<circle cx=\"8\" r=\"4\" fill=\"white\" stroke=\"{ARM}\" stroke-width=\"2\"/>");
    let bar = format!("<rect y=\"-3\" width=\"16\" height=\"6\" fill=\"{RANGE}\"/>");
    let signs = [
        (line(ARM) + &joint, "arm and joints at home"),
        (
            dot(2, WORKSPACE),
            "where the tip can be, held joints at rest",
        ),
        (line(PATHS[0]), "sinusoid"),
        (line(PATHS[1]), "quadrant"),
        (
            bar + &dot(5, HOME),
            "range of a joint, and its angle at home; limits of angle, torque and speed",
        ),
    ];
    let (mut svg, mut x, mut row) = (String::new(), BORDER_PX, 0_usize);
    for (sign, text) in signs {
        let length = 16.0 + GAP_PX + LETTER_PX * text.len() as f64;
        if x > BORDER_PX && x + length > width - BORDER_PX {
            (x, row) = (BORDER_PX, row + 1);
        }
        let y = VIEW_PX.1 + ROW_PX * (row as f64 + 0.5);
        let _ = writeln!(
            svg,
            "<g transform=\"translate({x} {y})\">{sign}<text x=\"22\" y=\"4\">{text}</text></g>"
        );
        x += length + GAP_PX;
    }
    (svg, row + 1)
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
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1\" fill=\"{WORKSPACE}\"/>"
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
    svg.push_str(&line(skeleton, ARM, 5.0));
    svg.push_str(&line(&paths[0], PATHS[0], 2.5));
    svg.push_str(&line(&paths[1], PATHS[1], 2.0));
    for joint in skeleton {
        let (x, y) = place(joint);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"white\" stroke=\"{ARM}\" stroke-width=\"2\"/>"
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

#[cfg(test)]
mod tests {
    use super::{BORDER_PX, LETTER_PX, legend, rounded};

    #[test]
    fn numbers_have_three_significant_digits() {
        for (value, text) in [
            (0.628_318_53, "0.628"),
            (-6.212_345, "-6.21"),
            (12.0, "12"),
            (0.0, "0"),
            (149.96, "150"),
            (1234.5, "1234"),
        ] {
            assert_eq!(rounded(value), text);
        }
    }

    #[test]
    fn the_legend_stays_within_the_drawing() {
        for width in [760.0, 600.0] {
            let (svg, rows) = legend(width);
            assert!(rows > 1);
            for group in svg.lines() {
                let x = group.split("translate(").nth(1).expect("a place");
                let x: f64 = x.split(' ').next().expect("x").parse().expect("a number");
                let text = group.split("\">").last().expect("a text");
                let letters = text.split('<').next().expect("a text").len();
                let end = x + 22.0 + LETTER_PX * letters as f64;
                assert!(end <= width, "{group}");
                assert!(x >= BORDER_PX);
            }
        }
    }
}
