//! A frame from the fuzzer's bytes: two of id, the rest payload.

use supple_puck::CanFrame;

pub fn frame(data: &[u8]) -> Option<CanFrame> {
    let (id, payload) = data.split_first_chunk()?;
    let id = u32::from(u16::from_le_bytes(*id));
    let frame = CanFrame::from_raw(id, payload);
    assert_eq!(frame.is_ok(), id <= 0x7ff && payload.len() <= 8);
    frame.ok()
}
