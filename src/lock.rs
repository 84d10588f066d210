//! Locks, and what is built once behind them.

use crate::error::Result;
use std::sync::{Arc, Mutex, MutexGuard};

/// A panic while a lock was held does not make its data wrong here: every value is replaced whole.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// What is built at first use and kept.
pub struct Kept<T>(Mutex<Option<Arc<T>>>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Kept<T> {
    /// Built from that of before where it does not hold any more; also says whether it was built now.
    pub fn get(
        &self,
        holds: impl FnOnce(&T) -> bool,
        build: impl FnOnce(Option<Arc<T>>) -> Result<T>,
    ) -> Result<(Arc<T>, bool)> {
        let mut kept = lock(&self.0);
        if let Some(known) = kept.as_ref().filter(|known| holds(known)) {
            return Ok((known.clone(), false));
        }
        let built = Arc::new(build(kept.take())?);
        *kept = Some(built.clone());
        Ok((built, true))
    }

    /// What is kept now.
    pub fn known(&self) -> Option<Arc<T>> {
        lock(&self.0).clone()
    }

    pub fn keep(&self, built: T) {
        *lock(&self.0) = Some(Arc::new(built));
    }

    pub fn forget(&self) {
        *lock(&self.0) = None;
    }
}
