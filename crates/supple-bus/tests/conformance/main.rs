//! One suite of the guarantees to a host, run on every backend and through the fault injector.
//!
//! The other side is a mirror: it answers each frame of the host with a frame of node 1 with the same payload.

mod backends;
mod mirror;
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
            a_cycle_of_frames_is_not_lost,
            a_silent_host_hears_what_one_hears_that_asks_each_time,
            waiting_ends_at_its_time,
            a_time_past_gives_what_is_there,
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
