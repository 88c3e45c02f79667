//! The numbers themselves, each declared once with its name.

/// Named numbers. A number once given keeps its meaning.
macro_rules! numbered {
    ($(#[doc = $doc:literal])+ $module:ident { $($name:ident = $number:literal $text:literal,)+ }) => {
        $(#[doc = $doc])+
        #[allow(missing_docs, reason = "the names say it")]
        pub mod $module {
            $(pub const $name: u8 = $number;)+

            /// Every name with its number.
            pub const ALL: &[(&str, u8)] = &[$(($text, $name),)+];
        }
    };
}

numbered! {
    /// Numbers of [`Request`](crate::controller::Request).
    request_kind {
        NONE = 0 "none",
        IDLE = 1 "idle",
        GRAVITY_HOLD = 2 "gravity_hold",
        MOVE = 3 "move",
        TRACK = 4 "track",
        GAINS = 5 "gains",
        RESET = 6 "reset",
        EXCITE = 7 "excite",
        BREAKAWAY = 8 "breakaway",
        FLOAT = 9 "float",
        JOINT_IMPEDANCE = 10 "joint_impedance",
        JOINT_GAINS = 11 "joint_gains",
        TRACK_POSE = 12 "track_pose",
        ROTATIONAL_GAINS = 13 "rotational_gains",
        LEARNING = 14 "learning",
        LEARNED_PARAMETERS = 15 "learned_parameters",
        LEARNED_MAP = 16 "learned_map",
        SET_POINT = 17 "set_point",
    }
}

numbered! {
    /// Numbers of [`Trajectory`](crate::Trajectory).
    trajectory_kind {
        NONE = 0 "none",
        HOLD = 1 "hold",
        LINE = 2 "line",
        SINUSOID = 3 "sinusoid",
        ARC = 4 "arc",
        QUADRANT = 5 "quadrant",
        PROBE = 6 "probe",
    }
}

numbered! {
    /// Numbers of [`crate::controller::Fault`].
    fault_kind {
        NONE = 0 "none",
        MEASUREMENT_NOT_FINITE = 1 "measurement_not_finite",
        ENCODER_LOST = 2 "encoder_lost",
        STATE_STALE = 3 "state_stale",
        STATE_OUT_OF_ORDER = 4 "state_out_of_order",
        JOINT_POSITION = 5 "joint_position",
        JOINT_SPEED = 6 "joint_speed",
        TIP_SPEED = 7 "tip_speed",
        TRACKING_ERROR = 8 "tracking_error",
        MASS_MATRIX = 9 "mass_matrix",
        TORQUE_NOT_FINITE = 10 "torque_not_finite",
        ENCODER_JUMP = 11 "encoder_jump",
        JOINT_TRACKING_ERROR = 12 "joint_tracking_error",
        JOINT_COLLISION = 13 "joint_collision",
        TIP_COLLISION = 14 "tip_collision",
        ENCODER_STUCK = 15 "encoder_stuck",
        ENCODER_UNRELIABLE = 16 "encoder_unreliable",
        MOVES_AGAINST_TORQUE = 17 "moves_against_torque",
        UNMODELLED_LOAD = 18 "unmodelled_load",
        WORKSPACE = 19 "workspace",
        ZONE_SPEED = 20 "zone_speed",
        ZONE_FORCE = 21 "zone_force",
        ROTATION_ERROR = 22 "rotation_error",
        SINGULAR = 23 "singular",
    }
}

numbered! {
    /// Numbers of [`crate::controller::Refusal`].
    refusal_kind {
        NONE = 0 "none",
        MODE = 1 "mode",
        VALUE = 2 "value",
        UNREACHABLE = 3 "unreachable",
        TOO_FAST = 4 "too_fast",
        FAR_FROM_START = 5 "far_from_start",
        TRAJECTORY = 6 "trajectory",
        DRIVES_IDLE = 7 "drives_idle",
        OUT_OF_REACH = 8 "out_of_reach",
        TOO_MUCH_TORQUE = 9 "too_much_torque",
        WORKSPACE = 10 "workspace",
        SINGULAR = 11 "singular",
        LEARNING_OFF = 12 "learning_off",
    }
}
