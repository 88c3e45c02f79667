//! The space that the arm sweeps: a box that contains all joint origins and the tip, and a drawing of it.

use std::fmt::Write;
use supple_core::dynamics::{joint_poses, tip_pose};
use supple_core::trajectory::Fourier;
use supple_core::{Config, Vector};

/// Number of poses of each series and of each move at which the arm is evaluated.
const POSES: usize = 400;
/// Thickness of the arm about the lines between its joints, added on all sides \[m\].
const THICKNESS_M: f64 = 0.1;
/// Size of a view \[px\].
const VIEW_PX: f64 = 340.0;
/// Margin of a view \[px\].
const MARGIN_PX: f64 = 40.0;

/// Space swept by an arm, base axes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sweep {
    /// Minimum of each coordinate \[m\].
    pub lower_m: [f64; 3],
    /// Maximum of each coordinate \[m\].
    pub upper_m: [f64; 3],
    /// Minimum of each joint angle \[rad\].
    pub lower_rad: Vec<f64>,
    /// Maximum of each joint angle \[rad\].
    pub upper_rad: Vec<f64>,
    /// Path of the tip, one list for each motion \[m\].
    #[serde(skip)]
    pub paths_m: Vec<Vec<[f64; 3]>>,
}

fn share(i: usize) -> f64 {
    i as f64 / POSES as f64
}

/// Returns the poses of a straight line in joint space.
fn line<const N: usize>(from_rad: Vector<N>, to_rad: Vector<N>) -> impl Iterator<Item = Vector<N>> {
    (0..=POSES).map(move |i| from_rad + (to_rad - from_rad) * share(i))
}

impl Sweep {
    /// Returns the space of these motions and of the moves between them in joint space.
    pub fn of<const N: usize>(
        config: &Config<N>,
        from_rad: &Vector<N>,
        all: &[Fourier<N>],
    ) -> Sweep {
        let mut sweep = Sweep::empty(N);
        let mut at_rad = *from_rad;
        for series in all {
            let start_rad = series.at(0.0).position_rad;
            let along = (0..=POSES).map(|i| series.at(series.duration_s * share(i)).position_rad);
            let mut path = Vec::new();
            for q in line(at_rad, start_rad).chain(along) {
                path.push(sweep.add(config, &q));
            }
            sweep.paths_m.push(path);
            at_rad = series.at(series.duration_s).position_rad;
        }
        sweep.with_thickness()
    }

    /// Returns the space as [`Sweep::of`] does, with the move to `end_rad` after the motions.
    pub fn of_motions<const N: usize>(
        config: &Config<N>,
        from_rad: &Vector<N>,
        all: &[Fourier<N>],
        end_rad: &Vector<N>,
    ) -> Sweep {
        let last = all.last();
        let last_rad = last.map_or(*from_rad, |series| {
            series.at(series.duration_s).position_rad
        });
        let end = Sweep::of_poses(config, &last_rad, &[], end_rad);
        Sweep::of(config, from_rad, all).with(end)
    }

    /// Returns the space of straight moves in joint space from one of a few distant poses to the next, and to `end_rad`.
    pub fn of_moves<const N: usize>(
        config: &Config<N>,
        from_rad: &Vector<N>,
        poses: &[Vector<N>],
        end_rad: &Vector<N>,
    ) -> Sweep {
        let mut last_rad = *from_rad;
        let mut all = Vec::new();
        for pose_rad in poses {
            all.extend(line(last_rad, *pose_rad));
            last_rad = *pose_rad;
        }
        Sweep::of_poses(config, from_rad, &all, end_rad)
    }

    /// Returns the space of a path of close poses in joint space, with straight moves to its start and from its end.
    pub fn of_poses<const N: usize>(
        config: &Config<N>,
        from_rad: &Vector<N>,
        poses: &[Vector<N>],
        end_rad: &Vector<N>,
    ) -> Sweep {
        let mut sweep = Sweep::empty(N);
        let mut path = Vec::new();
        let start_rad = poses.first().unwrap_or(end_rad);
        let last_rad = poses.last().unwrap_or(end_rad);
        let there = line(*from_rad, *start_rad);
        for q in there
            .chain(poses.iter().copied())
            .chain(line(*last_rad, *end_rad))
        {
            path.push(sweep.add(config, &q));
        }
        sweep.paths_m.push(path);
        sweep.with_thickness()
    }

    /// Returns the space of both.
    pub fn with(mut self, other: Sweep) -> Sweep {
        for axis in 0..3 {
            self.lower_m[axis] = self.lower_m[axis].min(other.lower_m[axis]);
            self.upper_m[axis] = self.upper_m[axis].max(other.upper_m[axis]);
        }
        for joint in 0..self.lower_rad.len() {
            self.lower_rad[joint] = self.lower_rad[joint].min(other.lower_rad[joint]);
            self.upper_rad[joint] = self.upper_rad[joint].max(other.upper_rad[joint]);
        }
        self.paths_m.extend(other.paths_m);
        self
    }

    fn empty(joints: usize) -> Sweep {
        Sweep {
            lower_m: [f64::MAX; 3],
            upper_m: [f64::MIN; 3],
            lower_rad: vec![f64::MAX; joints],
            upper_rad: vec![f64::MIN; joints],
            paths_m: Vec::new(),
        }
    }

    fn with_thickness(mut self) -> Sweep {
        for axis in 0..3 {
            self.lower_m[axis] -= THICKNESS_M;
            self.upper_m[axis] += THICKNESS_M;
        }
        self
    }

    fn add_point(&mut self, point_m: [f64; 3]) {
        for (axis, value_m) in point_m.into_iter().enumerate() {
            self.lower_m[axis] = self.lower_m[axis].min(value_m);
            self.upper_m[axis] = self.upper_m[axis].max(value_m);
        }
    }

    /// Returns whether the other space lies within this space.
    pub fn contains(&self, other: &Sweep) -> bool {
        self.contains_within(other, 0.0)
    }

    /// Returns whether the other space lies within this space and this margin \[m\] around it.
    pub fn contains_within(&self, other: &Sweep, margin_m: f64) -> bool {
        let within = |axis: usize| {
            other.lower_m[axis] >= self.lower_m[axis] - margin_m
                && other.upper_m[axis] <= self.upper_m[axis] + margin_m
        };
        (0..3).all(within)
    }

    fn add<const N: usize>(&mut self, config: &Config<N>, q: &Vector<N>) -> [f64; 3] {
        let tip_m: [f64; 3] = tip_pose(&config.arm, q).translation.into();
        let joints = joint_poses(&config.arm, q).map(|pose| pose.translation.into());
        for point in joints.into_iter().chain([tip_m]) {
            self.add_point(point);
        }
        for joint in 0..N {
            self.lower_rad[joint] = self.lower_rad[joint].min(q[joint]);
            self.upper_rad[joint] = self.upper_rad[joint].max(q[joint]);
        }
        tip_m
    }

    /// Returns the space as one line of text.
    pub fn text(&self) -> String {
        let axis = |name: &str, i: usize| {
            format!("{name} {:.2} to {:.2} m", self.lower_m[i], self.upper_m[i])
        };
        format!("{}, {}, {}", axis("x", 0), axis("y", 1), axis("z", 2))
    }

    /// Returns an SVG drawing: views from the side, from above and from the front, with the path of the tip.
    pub fn svg(&self) -> String {
        let (width, height) = (3.0 * VIEW_PX, VIEW_PX + 20.0);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
             font-size=\"11\" role=\"img\"><title>Space that the arm sweeps</title>\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let span = |axis: usize| self.upper_m[axis].max(0.0) - self.lower_m[axis].min(0.0);
        let scale = (VIEW_PX - 2.0 * MARGIN_PX) / (0..3).map(span).fold(0.1, f64::max);
        let views = [
            ("from the side", "x", 0, "z", 2),
            ("from above", "x", 0, "y", 1),
            ("from the front", "y", 1, "z", 2),
        ];
        for (order, (title, name_u, u, name_v, v)) in views.into_iter().enumerate() {
            let left = order as f64 * VIEW_PX + MARGIN_PX;
            let bottom = VIEW_PX - MARGIN_PX;
            let x = |m: f64| left + scale * (m - self.lower_m[u].min(0.0));
            let y = |m: f64| bottom - scale * (m - self.lower_m[v].min(0.0));
            let (x0, x1) = (x(self.lower_m[u]), x(self.upper_m[u]));
            let (y0, y1) = (y(self.upper_m[v]), y(self.lower_m[v]));
            let _ = writeln!(
                svg,
                "<rect x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#eef\" stroke=\"#336\"/>",
                x1 - x0,
                y1 - y0
            );
            for path in &self.paths_m {
                let points = path
                    .iter()
                    .map(|p| format!("{:.1},{:.1}", x(p[u]), y(p[v])));
                let points: Vec<String> = points.collect();
                let _ = writeln!(
                    svg,
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"#06c\" stroke-width=\"0.7\"/>",
                    points.join(" ")
                );
            }
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"#c00\"/>\
                 <text x=\"{left:.1}\" y=\"16\">{title}: {name_u} {:.2} to {:.2} m, {name_v} {:.2} to {:.2} m</text>",
                x(0.0),
                y(0.0),
                self.lower_m[u],
                self.upper_m[u],
                self.lower_m[v],
                self.upper_m[v]
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{MARGIN_PX}\" y=\"{:.1}\">red: origin of the base axes; blue: tip; the box is {THICKNESS_M} m \
             wider than all joints and the tip on every side</text></svg>",
            VIEW_PX + 8.0
        );
        svg
    }
}
