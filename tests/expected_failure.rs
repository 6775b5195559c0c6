//! Runs that must fail.

use std::fmt::{self, Debug};
use std::ops::Deref;

use qemu::Failure;

/// A failure that a test expects. Its evidence is removed if the test succeeds, and kept if the test fails.
pub struct ExpectedFailure(Failure);

impl ExpectedFailure {
    /// Returns the failure of a run that must not succeed.
    #[track_caller]
    pub fn of<T: Debug>(result: anyhow::Result<T>) -> Self {
        let error = result.expect_err("the run succeeded");
        Self(error.downcast().expect("a failure with a verdict"))
    }
}

impl Deref for ExpectedFailure {
    type Target = Failure;

    fn deref(&self) -> &Failure {
        &self.0
    }
}

impl fmt::Display for ExpectedFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

impl Drop for ExpectedFailure {
    fn drop(&mut self) {
        if let (Some(folder), false) = (&self.0.evidence, std::thread::panicking()) {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
}
