//! One suite of the guarantees to a host, run on every backend and through the fault injector.
//!
//! The arm's side echoes: its node answers each frame of the host with a frame of the same payload.

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
            every_length_and_id_crosses_unchanged,
            frames_keep_their_order,
            every_length_of_fd_and_extended_ids_cross_unchanged,
            a_cycle_of_frames_is_not_lost,
            lookahead_gives_the_same_events_in_the_same_order,
            waiting_ends_at_the_deadline,
            a_deadline_in_the_past_returns_without_waiting,
            time_never_goes_back,
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
