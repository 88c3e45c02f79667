//! Entry point of `supple-ros`: the bridge of a running system to ROS 2.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple_ros::run)
}
