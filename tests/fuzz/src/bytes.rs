//! Conversion between bytes and plain values, and temporary files with given bytes.

use core::cell::OnceCell;
use core::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use supple_ipc::message::{ArmState, OperatorReply, OperatorRequest, Telemetry, TorqueCommand};
use tempfile::TempDir;

/// Plain old data: every bit pattern is a valid value.
///
/// # Safety
/// The type has no padding and no field with an invalid pattern: integers, floats and arrays of them.
pub unsafe trait AnyBitPattern: Copy {}

// SAFETY: by the rule of their module, messages of supple-ipc are numbers and arrays of numbers without padding,
// because shared memory may contain any bytes.
unsafe impl AnyBitPattern for ArmState {}
// SAFETY: as above.
unsafe impl AnyBitPattern for TorqueCommand {}
// SAFETY: as above.
unsafe impl AnyBitPattern for OperatorRequest {}
// SAFETY: as above.
unsafe impl AnyBitPattern for OperatorReply {}
// SAFETY: as above.
unsafe impl AnyBitPattern for Telemetry {}

/// Returns the value with these bytes; missing bytes are zero, additional bytes are ignored.
pub fn value_of<T: AnyBitPattern>(bytes: &[u8]) -> T {
    let mut value = MaybeUninit::<T>::zeroed();
    let length = bytes.len().min(size_of::<T>());
    // SAFETY: `length` bytes are within both, and every bit pattern is a valid `T`.
    unsafe {
        core::ptr::copy_nonoverlapping(bytes.as_ptr(), value.as_mut_ptr().cast(), length);
        value.assume_init()
    }
}

/// Returns the bytes of a value.
pub fn bytes_of<T: AnyBitPattern>(value: &T) -> Vec<u8> {
    let start: *const u8 = core::ptr::from_ref(value).cast();
    // SAFETY: a `T` has no padding, so all of its bytes were written.
    unsafe { core::slice::from_raw_parts(start, size_of::<T>()) }.to_vec()
}

/// Returns all values in the bytes; the last value is padded with zeros.
pub fn values_of<T: AnyBitPattern>(bytes: &[u8]) -> impl Iterator<Item = T> {
    bytes.chunks(size_of::<T>()).map(value_of)
}

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// Calls `body` with the path of a file with these bytes, in a folder that only this thread uses.
pub fn with_file<R>(name: &str, bytes: &[u8], body: impl FnOnce(&Path) -> R) -> R {
    let path = FOLDER.with(|folder| -> PathBuf {
        let folder = folder.get_or_init(|| tempfile::tempdir().expect("a folder for inputs"));
        folder.path().join(name)
    });
    std::fs::write(&path, bytes).expect("room for an input");
    body(&path)
}
