//! Locks.

use std::sync::{Mutex, MutexGuard};

/// A panic while a lock was held does not make its data wrong here: every value is replaced whole.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}
