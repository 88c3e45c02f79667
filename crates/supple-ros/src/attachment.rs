//! What rmw_zenoh attaches to each message: sequence number, time and the publisher's id.

use xxhash_rust::xxh3::xxh3_128;

/// Attachments of one publisher.
#[derive(Clone, Debug)]
pub(crate) struct Attachments {
    /// Digest of the publisher's token.
    id: [u8; 16],
    sequence: i64,
}

impl Attachments {
    /// Creates the attachments of the publisher with this token.
    pub fn new(token: &str) -> Attachments {
        Attachments {
            id: xxh3_128(token.as_bytes()).to_le_bytes(),
            sequence: 0,
        }
    }

    /// Returns the attachment of the next message; `time_ns` counts from the epoch.
    pub fn next(&mut self, time_ns: u64) -> Vec<u8> {
        self.sequence += 1;
        let mut bytes = Vec::with_capacity(33);
        bytes.extend(self.sequence.to_le_bytes());
        bytes.extend(time_ns.to_le_bytes());
        // The length of the id.
        bytes.push(self.id.len() as u8);
        bytes.extend(self.id);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::Attachments;

    #[test]
    fn an_attachment_has_sequence_time_and_id() {
        let mut attachments = Attachments::new("@ros2_lv/0/a/0/1/MP");
        let first = attachments.next(0x0102_0304);
        assert_eq!(first.len(), 33);
        assert_eq!(first[..8], [1, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(first[8..16], [4, 3, 2, 1, 0, 0, 0, 0]);
        assert_eq!(first[16], 16);
        let second = attachments.next(0);
        assert_eq!((second[0], &second[17..]), (2, &first[17..]));
    }
}
