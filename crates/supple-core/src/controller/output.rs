//! The input and the output of a step, and the record of both. The list below declares every quantity once: telemetry,
//! the log and its message definition, fault files and Python columns are derived from it (see [`crate::record`]).

use super::fault::{Fault, SafeAction};
use super::mode::{Mode, Refusal, Request};
use super::pose_task::PoseCycle;
use super::words::NamesJoints;
use crate::config::{Gains, JointGains, JointNames, RotationalGains};
use crate::controller::codes::{self, FaultCode, RequestCode, RequestCodeError, VALUES};
use crate::law::torques::Torques;
use crate::math::{Matrix3, Vector, Vector3};
use crate::model::learned::LearnedParameters;
use crate::model::pose::rotation_vector;
use crate::record::{Field, List, Pack, Recorded, Text, Unpack, words_of};
use crate::trajectory::Reference;

/// Measurements and requests of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<const N: usize> {
    /// Number of the cycle in which the state was measured; one more each period.
    pub cycle: u64,
    /// Joint angles \[rad\]; `None` if the encoder did not answer.
    pub position_rad: [Option<f64>; N],
    /// Measured force on the tip, base axes \[N\]; used only with a chosen apparent inertia.
    pub tip_force_n: Option<Vector3<f64>>,
    /// Whether the motors apply the commanded torques. If they do not, the controller computes gravity compensation at
    /// the present pose.
    pub drives_active: bool,
    /// The operator's request, if there is one.
    pub request: Option<Request<N>>,
}

/// Reference of the tip's orientation in the track pose mode, and the tip's deviation from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// The reference: columns are the axes of the tip in base coordinates.
    pub base_from_tip: Matrix3<f64>,
    /// Axis times angle from the tip to its reference, base axes \[rad\].
    pub error_rad: Vector3<f64>,
}

impl Orientation {
    pub(super) fn new<const N: usize>(pose: &PoseCycle<N>) -> Orientation {
        Orientation {
            base_from_tip: pose.base_from_tip(),
            error_rad: pose.error_rad,
        }
    }
}

/// Type of a quantity in [`Output`].
macro_rules! in_output {
    (number, $n:ident) => { f64 };
    (flag, $n:ident) => { bool };
    (joints, $n:ident) => { Vector<$n> };
    (vector, $n:ident) => { Vector3<f64> };
}

/// Type of a quantity in [`CycleRecord`].
macro_rules! in_record {
    (number, $n:ident) => { f64 };
    (flag, $n:ident) => { bool };
    (joints, $n:ident) => { Vector<$n> };
    (vector, $n:ident) => { [f64; 3] };
    (counter, $n:ident) => { u64 };
    (code, $n:ident) => { u8 };
    (index, $n:ident) => { i8 };
    (joint_flags, $n:ident) => { [bool; $n] };
    (numbers, $n:ident) => { List<VALUES> };
    (text, $n:ident) => { Text };
    (terms, $n:ident) => { Torques<$n> };
}

/// Declares the quantities in three lists: those of the record alone, with their values; those of both; those of the output
/// alone.
macro_rules! cycle {
    (
        record($step:ident, $input:ident, $output:ident; $($code:ident = $of:expr),+) {
            $($(#[doc = $record_doc:literal])+ $record_kind:ident $record:ident = $value:expr;)*
        }
        both {
            $($(#[doc = $both_doc:literal])+ $both_kind:ident $both:ident;)*
        }
        output {
            $($(#[doc = $output_doc:literal])+ $only:ident: $type:ty;)*
        }
    ) => {
        /// Torques of one cycle and the quantities that led to them.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Output<const N: usize> {
            $($(#[doc = $output_doc])+ pub $only: $type,)*
            $($(#[doc = $both_doc])+ pub $both: in_output!($both_kind, N),)*
        }

        /// One cycle of the controller as plain numbers: input, output, and every term of the torque. Joints in order,
        /// vectors as x, y, z in base axes, SI units. If a `has_x` is false there was no x and its entries are zero.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct CycleRecord<const N: usize> {
            $($(#[doc = $record_doc])+ pub $record: in_record!($record_kind, N),)*
            $($(#[doc = $both_doc])+ pub $both: in_record!($both_kind, N),)*
        }

        impl<const N: usize> CycleRecord<N> {
            /// Every field, in order.
            pub const FIELDS: &'static [Field] = &[
                $(Field {
                    name: stringify!($record),
                    shape: <in_record!($record_kind, N) as Recorded<N>>::SHAPE,
                    description: concat!($($record_doc, "\n"),+),
                },)*
                $(Field {
                    name: stringify!($both),
                    shape: <in_record!($both_kind, N) as Recorded<N>>::SHAPE,
                    description: concat!($($both_doc, "\n"),+),
                },)*
            ];

            /// Records a step; `step` is its number since the controller started.
            pub fn new($step: u64, $input: &Input<N>, $output: &Output<N>) -> Self {
                $(let $code = $of;)+
                CycleRecord {
                    $($record: $value,)*
                    $($both: $output.$both.into(),)*
                }
            }

            /// Writes the words of every field, [`CycleRecord::words`] of them.
            ///
            /// # Panics
            /// If `words` is too short.
            pub fn pack(&self, words: &mut [u64]) {
                let mut to = Pack::new(words);
                $(Recorded::<N>::pack(&self.$record, &mut to);)*
                $(Recorded::<N>::pack(&self.$both, &mut to);)*
            }

            /// Reads the first `N` joints of a record that [`CycleRecord::pack`] wrote for an arm of `joints` joints; values of
            /// joints that the arm does not have are zero.
            pub fn unpack(words: &[u64], joints: usize) -> Self {
                let mut from = Unpack::new(words, joints);
                CycleRecord {
                    $($record: Recorded::<N>::unpack(&mut from),)*
                    $($both: Recorded::<N>::unpack(&mut from),)*
                }
            }
        }
    };
}

cycle! {
    record(
        step, input, output;
        request_code = RequestCode::new(input.request.as_ref()),
        fault_code = FaultCode::new(output.fault.as_ref())
    ) {
        /// Number of this step since the controller started. A gap means that the log has lost records.
        counter step = step;
        /// Input: cycle in which the state was measured.
        counter input_cycle = input.cycle;
        /// Encoders that answered.
        joint_flags has_measured_position = input.position_rad.map(|position| position.is_some());
        /// Measured joint angles \[rad\].
        joints measured_position_rad = Vector::from(input.position_rad.map(Option::unwrap_or_default));
        /// The force sensor answered.
        flag has_tip_force = input.tip_force_n.is_some();
        /// Measured force on the tip \[N\].
        vector tip_force_n = input.tip_force_n.unwrap_or_default().into();
        /// The motors applied torques. Logs without this field are read as if they did.
        flag drives_active = input.drives_active;
        /// Kind of the request.
        code request = request_code.kind;
        /// Kind of the trajectory of a track or track_pose request.
        code trajectory = request_code.trajectory;
        /// Values of the request, vectors as x, y, z:
        /// move, joint_impedance  target_rad (N), duration_s
        /// joint_gains  stiffness_nm_per_rad (N), damping_nm_s_per_rad (N), ramp_s
        /// excite    centre_rad (N), sine_rad (5 harmonics of N), cosine_rad (5 of N),
        ///           angular_frequency_rad_per_s, duration_s, ramp_s
        /// breakaway joint, rate_nm_per_s, stop_rad, limit_nm
        /// track_pose  axis, angle_rad, duration_s of the rotation, then the values of the trajectory
        /// rotational_gains  stiffness_nm_per_rad, damping_nm_s_per_rad, ramp_s
        /// gain_matrices  part (0 linear, 1 rotational), stiffness and damping as xx, yy, zz, yz, zx, xy,
        ///           axes (0 base, 1 tip), ramp_s
        /// gains     stiffness_n_per_m, damping_n_s_per_m, ramp_s
        /// learning  0 off, 1 on, 2 reset
        /// learned_parameters  viscous_nm_s_per_rad (N), coulomb_nm (N), offset_nm (N), torque_scale (N), payload_kg,
        ///           payload_moment_kg_m, tilt_rad
        /// learned_map  joint, torque_nm (16), dry_nm (16)
        /// set_point position_m, velocity_m_per_s, acceleration_m_per_s2, at_cycle
        /// hold      position_m
        /// line      from_m, to_m, duration_s
        /// sinusoid  centre_m, amplitude_m, angular_frequency_rad_per_s, ramp_s
        /// arc       radius_m, height_m, centre_rad, amplitude_rad, angular_frequency_rad_per_s, ramp_s
        /// quadrant  centre_m, first_m, second_m, speed_m_per_s, ramp_s, corner_ramp_s
        /// probe     radius_m, strokes, radial_step_m, top_m, stroke_m, azimuth_rad, azimuth_step_rad,
        ///           speed_m_per_s, ramp_s, dwell_s
        numbers request_values = List::new(request_code.values());
        /// Output: cycle of the state that this step answers.
        counter cycle = output.cycle;
        /// Mode in force.
        code mode = output.mode as u8;
        /// Terms whose sum, once limited, is `torque_nm` \[N m\].
        terms torques = output.torques;
        /// A tip trajectory runs.
        flag has_reference = output.reference.is_some();
        /// Reference of the tip's position \[m\].
        vector reference_position_m = of_reference(output, |reference| reference.position);
        /// Reference of the tip's velocity \[m/s\].
        vector reference_velocity_m_per_s = of_reference(output, |reference| reference.velocity);
        /// Reference of the tip's acceleration \[m/s^2\].
        vector reference_acceleration_m_per_s2 = of_reference(output, |reference| reference.acceleration);
        /// The tip's orientation has a reference.
        flag has_orientation_reference = output.orientation.is_some();
        /// Reference of the tip's orientation: axis times angle, from the base axes \[rad\].
        vector reference_rotation_rad =
            of_orientation(output, |orientation| rotation_vector(&orientation.base_from_tip));
        /// Rotation from the tip to that reference: axis times angle, base axes \[rad\].
        vector rotation_error_rad = of_orientation(output, |orientation| orientation.error_rad);
        /// Stiffness `K` in force \[N/m\]; in the pose mode the diagonal of its matrix, in the axes of the request.
        vector stiffness_n_per_m = output.gains.stiffness_n_per_m.into();
        /// Damping `B` in force \[N s/m\]; as the stiffness.
        vector damping_n_s_per_m = output.gains.damping_n_s_per_m.into();
        /// Stiffness of the joint impedance mode in force \[N m/rad\].
        joints joint_stiffness_nm_per_rad = output.joint_gains.stiffness_nm_per_rad;
        /// Damping of the joint impedance mode in force \[N m s/rad\].
        joints joint_damping_nm_s_per_rad = output.joint_gains.damping_nm_s_per_rad;
        /// Rotational stiffness of the pose mode in force \[N m/rad\]: the diagonal of its matrix, in the axes of the request.
        vector rotational_stiffness_nm_per_rad = output.rotational_gains.stiffness_nm_per_rad.into();
        /// Rotational damping of the pose mode in force \[N m s/rad\]; as the stiffness.
        vector rotational_damping_nm_s_per_rad = output.rotational_gains.damping_nm_s_per_rad.into();
        /// Learned change of the viscous friction \[N m s/rad\].
        joints learned_viscous_nm_s_per_rad = output.learned.viscous_nm_s_per_rad;
        /// Learned change of the Coulomb friction \[N m\].
        joints learned_coulomb_nm = output.learned.coulomb_nm;
        /// Learned torque offset \[N m\].
        joints learned_offset_nm = output.learned.offset_nm;
        /// Learned share of the model's torque by which the drives fall short.
        joints learned_torque_scale = output.learned.torque_scale;
        /// Learned mass of a payload at the tip \[kg\].
        number learned_payload_kg = output.learned.payload_kg;
        /// Its first moment in the tip frame \[kg m\].
        vector learned_payload_moment_kg_m = output.learned.payload_moment_kg_m.into();
        /// Learned rotation of gravity: axis times angle, base axes \[rad\].
        vector learned_tilt_rad = output.learned.tilt_rad.into();
        /// Kind of the latched fault.
        code fault = fault_code.kind;
        /// Joint of the fault, counted from 0, or -1.
        index fault_joint = fault_code.joint;
        /// Value that broke the limit.
        number fault_value = fault_code.value;
        /// The limit.
        number fault_limit = fault_code.limit;
        /// The fault in words.
        text fault_text = in_words(output.fault.as_ref(), &[]);
        /// Kind of the refusal of this cycle's request.
        code refusal = codes::refusal(output.refusal.as_ref());
        /// The refusal in words.
        text refusal_text = in_words(output.refusal.as_ref(), &[]);
    }
    both {
        /// Time since the mode was entered \[s\].
        number mode_time_s;
        /// Joint torques to send \[N m\].
        joints torque_nm;
        /// Joint torques to apply if the next answer does not come: gravity at the last trusted pose, zero in
        /// idle \[N m\].
        joints fallback_torque_nm;
        /// A joint or motor torque limit cut the sum.
        flag torque_limited;
        /// The torque-rate limit cut the sum.
        flag rate_limited;
        /// Joint angles used: measured, or extrapolated over a lost reply \[rad\].
        joints position_rad;
        /// Estimated joint velocities \[rad/s\].
        joints velocity_rad_per_s;
        /// Tip position \[m\].
        vector tip_position_m;
        /// Tip velocity \[m/s\].
        vector tip_velocity_m_per_s;
        /// Observed external torque \[N m\].
        joints external_torque_nm;
        /// Observed force on the tip \[N\].
        vector external_force_n;
        /// Observed force against the reference's motion \[N\].
        number force_against_n;
        /// Force against the reference's motion at which contact latches now \[N\].
        number contact_threshold_n;
        /// Contact is latched.
        flag in_contact;
        /// Learning is on: new learned terms are accepted.
        flag learning;
        /// Share of the dry friction feed-forward applied, 0 to 1; joints with known presliding have all of it in contact.
        number friction_share;
        /// Smallest singular value of the active joints' linear Jacobian \[m\].
        number min_singular_value_m;
    }
    output {
        /// Cycle of the state that this answers.
        cycle: u64;
        /// Mode in force.
        mode: Mode;
        /// No torque is wanted: idle, or a fault in which there must be none.
        torque_off: bool;
        /// Latched fault.
        fault: Option<Fault>;
        /// Safe action in force in a fault; braking if the arm did not come to rest.
        safe_action: Option<SafeAction>;
        /// Why this cycle's request was refused.
        refusal: Option<Refusal>;
        /// Terms whose sum, once limited, is `torque_nm`.
        torques: Torques<N>;
        /// Reference of the tip; `None` if no tip trajectory runs.
        reference: Option<Reference>;
        /// Reference of the tip's orientation; `None` in other modes than the pose mode.
        orientation: Option<Orientation>;
        /// Gains in force.
        gains: Gains;
        /// Gains of the joint impedance mode in force.
        joint_gains: JointGains<N>;
        /// Rotational gains of the pose mode in force.
        rotational_gains: RotationalGains;
        /// Learned parameters in force.
        learned: LearnedParameters<N>;
    }
}

fn in_words(message: Option<&impl NamesJoints>, names: &[Text]) -> Text {
    message.map_or(Text::EMPTY, |message| {
        Text::from_display(&message.with_names(names))
    })
}

fn of_orientation<const N: usize>(
    output: &Output<N>,
    part: fn(&Orientation) -> Vector3<f64>,
) -> [f64; 3] {
    output
        .orientation
        .as_ref()
        .map_or([0.0; 3], |orientation| part(orientation).into())
}

fn of_reference<const N: usize>(
    output: &Output<N>,
    part: fn(&Reference) -> Vector3<f64>,
) -> [f64; 3] {
    output
        .reference
        .as_ref()
        .map_or([0.0; 3], |reference| part(reference).into())
}

impl<const N: usize> CycleRecord<N> {
    /// Words of the record of an arm with `joints` joints.
    pub const fn words(joints: usize) -> usize {
        words_of(Self::FIELDS, joints)
    }

    /// Returns the record with the fault and refusal texts of `output` written with these joint names.
    pub fn with_joint_names(mut self, output: &Output<N>, names: &JointNames<N>) -> Self {
        self.fault_text = in_words(output.fault.as_ref(), names.as_slice());
        self.refusal_text = in_words(output.refusal.as_ref(), names.as_slice());
        self
    }

    /// Returns the input of the step, bit for bit.
    ///
    /// # Errors
    /// An error if this version does not have the recorded request.
    pub fn input(&self) -> Result<Input<N>, RequestCodeError> {
        let position =
            |i: usize| self.has_measured_position[i].then_some(self.measured_position_rad[i]);
        Ok(Input {
            cycle: self.input_cycle,
            position_rad: core::array::from_fn(position),
            tip_force_n: self.has_tip_force.then(|| Vector3::from(self.tip_force_n)),
            drives_active: self.drives_active,
            request: self.request_code()?.request()?,
        })
    }

    /// Returns the request as numbers.
    ///
    /// # Errors
    /// An error if the record has more values than a request can have.
    pub fn request_code(&self) -> Result<RequestCode, RequestCodeError> {
        RequestCode::from_parts(self.request, self.trajectory, self.request_values.values())
    }

    /// Returns the mode in force; `None` if this version does not have it.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }

    /// Returns the distance of the tip from its reference \[m\]; `None` if there is no reference.
    pub fn tip_error_m(&self) -> Option<f64> {
        let error = Vector3::from(self.reference_position_m) - Vector3::from(self.tip_position_m);
        self.has_reference
            .then(|| crate::math::sqrt(error.dot(&error)))
    }
}
