//! Tests of what a bus guarantees to the host, run on every backend and through the fault injector.
//!
//! The arm's side is an echo node: it answers each frame of the host with a frame of the same payload.

mod backends;
mod echo;
mod suite;

macro_rules! conformance {
    ($backend:ident: $($case:ident),* $(,)?) => {
        mod $backend {
            $(
                #[test]
                fn $case() {
                    if let Some((_arm, bus)) = crate::backends::$backend() {
                        crate::suite::$case(bus);
                    }
                }
            )*
        }
    };
}

macro_rules! on_every_backend {
    ($($backend:ident),*) => {
        $(conformance!($backend:
            a_frame_is_confirmed_once_and_then_answered,
            frames_of_every_length_and_id_arrive_unchanged,
            frames_arrive_in_the_order_in_which_they_were_sent,
            fd_frames_of_every_length_with_either_id_format_arrive_unchanged,
            no_frame_of_repeated_cycles_is_lost,
            lookahead_gives_the_same_events_in_the_same_order,
            receive_without_events_returns_at_the_deadline,
            receive_with_a_past_deadline_returns_without_waiting,
            bus_time_never_decreases,
        );)*
    };
}

on_every_backend!(
    direct,
    lockstep,
    paced,
    datagram,
    socket_can,
    injected_direct,
    injected_datagram
);
