//! Bytes as plain values, and files that hold them.

use core::cell::OnceCell;
use core::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use supple_ipc::message::{ArmState, OperatorReply, OperatorRequest, Telemetry, TorqueCommand};
use tempfile::TempDir;

/// Plain old data in which every pattern of bits is a value.
///
/// # Safety
/// The type has no padding and no field with an invalid pattern: whole numbers, floats and arrays of them.
pub unsafe trait AnyBits: Copy {}

// SAFETY: messages of supple-ipc are, by their module's own rule, numbers and arrays of numbers without padding:
// shared memory may hold anything.
unsafe impl AnyBits for ArmState {}
// SAFETY: as above.
unsafe impl AnyBits for TorqueCommand {}
// SAFETY: as above.
unsafe impl AnyBits for OperatorRequest {}
// SAFETY: as above.
unsafe impl AnyBits for OperatorReply {}
// SAFETY: as above.
unsafe impl AnyBits for Telemetry {}

/// The value with these bytes; zeros where there are too few, the rest is left out.
pub fn value_of<T: AnyBits>(bytes: &[u8]) -> T {
    let mut value = MaybeUninit::<T>::zeroed();
    let length = bytes.len().min(size_of::<T>());
    // SAFETY: `length` bytes are within both, and every pattern of bits is a `T`.
    unsafe {
        core::ptr::copy_nonoverlapping(bytes.as_ptr(), value.as_mut_ptr().cast(), length);
        value.assume_init()
    }
}

/// The bytes of a value.
pub fn bytes_of<T: AnyBits>(value: &T) -> Vec<u8> {
    let start: *const u8 = core::ptr::from_ref(value).cast();
    // SAFETY: a `T` has no padding, so all of its bytes were written.
    unsafe { core::slice::from_raw_parts(start, size_of::<T>()) }.to_vec()
}

/// All values in the bytes, the last one filled up with zeros.
pub fn values_of<T: AnyBits>(bytes: &[u8]) -> impl Iterator<Item = T> {
    bytes.chunks(size_of::<T>()).map(value_of)
}

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// Gives `body` the path of a file with these bytes, in a folder of this thread that nobody else uses.
pub fn with_file<R>(name: &str, bytes: &[u8], body: impl FnOnce(&Path) -> R) -> R {
    let path = FOLDER.with(|folder| -> PathBuf {
        let folder = folder.get_or_init(|| tempfile::tempdir().expect("a folder for inputs"));
        folder.path().join(name)
    });
    std::fs::write(&path, bytes).expect("room for an input");
    body(&path)
}
