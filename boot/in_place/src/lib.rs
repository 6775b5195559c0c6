//! Builds large values on the heap without a copy on the stack.
//!
//! `Box::new(Large::new())` builds its argument on the stack unless the compiler optimises that away, and a
//! thread has 2 MiB of stack or less. [`boxed!`] copies an empty value from a static to the heap in one
//! piece.
//!
//! ```
//! #[derive(Clone, Copy)]
//! struct Large([u8; 4 << 20]);
//!
//! impl Large {
//!     const fn new() -> Self {
//!         Self([0; 4 << 20])
//!     }
//! }
//!
//! let mut large = in_place::boxed!(Large);
//! large.0[0] = 1;
//! ```
#![forbid(unsafe_code)]

use std::ops::{Deref, DerefMut};
use std::slice;
/// Used by [`boxed!`], also in crates without `std`.
#[doc(hidden)]
pub use std::sync::Mutex;

/// A value on the heap.
///
/// It is a slice of one element: only slices can be copied into a box without unsafe code and without a
/// detour over the stack.
#[derive(Clone, Debug)]
pub struct InPlace<T>(Box<[T]>);

impl<T: Copy> InPlace<T> {
    /// Returns a copy of `value` on the heap.
    pub fn copy_of(value: &T) -> Self {
        Self(Box::from(slice::from_ref(value)))
    }
}

impl<T> Deref for InPlace<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0[0]
    }
}

impl<T> DerefMut for InPlace<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0[0]
    }
}

/// Returns an [`InPlace`] with the value of `TYPE::new()`, which must be a constant.
///
/// The source of the copy is a static behind a lock, so that a value of zeros needs no space in the
/// program's file.
#[macro_export]
macro_rules! boxed {
    ($of:ty) => {{
        static EMPTY: $crate::Mutex<$of> = $crate::Mutex::new(<$of>::new());
        // Only the copy happens under the lock, so nothing can poison it.
        $crate::InPlace::copy_of(&*EMPTY.lock().unwrap())
    }};
}

#[cfg(test)]
mod tests {
    use std::thread;

    #[derive(Clone, Copy)]
    struct Large {
        bytes: [u8; 64 << 20],
    }

    impl Large {
        const fn new() -> Self {
            Self {
                bytes: [0; 64 << 20],
            }
        }
    }

    #[test]
    fn a_large_value_needs_no_stack() {
        let work = || {
            let mut large = crate::boxed!(Large);
            large.bytes[1 << 20] = 1;
            large.bytes[1 << 20]
        };
        let thread = thread::Builder::new().stack_size(64 << 10).spawn(work);
        assert_eq!(thread.unwrap().join().unwrap(), 1);
    }
}
