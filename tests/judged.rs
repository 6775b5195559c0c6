//! Runs that must not go well.

use qemu::Failure;

/// A failure whose evidence goes when the test has ended well, and stays when it has not.
pub struct Judged(pub Failure);

impl Drop for Judged {
    fn drop(&mut self) {
        if let (Some(folder), false) = (&self.0.evidence, std::thread::panicking()) {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
}

/// What went wrong.
#[track_caller]
pub fn verdict<T: std::fmt::Debug>(result: anyhow::Result<T>) -> Failure {
    let error = result.expect_err("the run ended well");
    error.downcast().expect("a failure with a verdict")
}
