//! Runs that must fail.

use qemu::Failure;

/// A failure. Its evidence is removed if the test succeeds, and kept if the test fails.
pub struct Judged(pub Failure);

impl Drop for Judged {
    fn drop(&mut self) {
        if let (Some(folder), false) = (&self.0.evidence, std::thread::panicking()) {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
}

/// Returns the failure of a run that must not succeed.
#[track_caller]
pub fn verdict<T: std::fmt::Debug>(result: anyhow::Result<T>) -> Failure {
    let error = result.expect_err("the run ended well");
    error.downcast().expect("a failure with a verdict")
}
