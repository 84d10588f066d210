//! What can go wrong, one variant for each kind of fault.

/// An error of lixel. The message is one sentence that names the argument, the rule and the value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The caller's fault: an argument breaks a rule. Python sees a `ValueError`.
    #[error("{0}")]
    Value(String),
    /// The caller's fault: an argument is of the wrong kind. Python sees a `TypeError`.
    #[error("{0}")]
    Type(String),
    /// The machine's fault: no adapter, a missing feature, a limit, a lost device. Python sees a
    /// `lixel.DeviceError`.
    #[error("{0}")]
    Device(String),
}

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// `return Err(Error::Value(format!(...)))` unless the condition holds.
macro_rules! ensure_value {
    ($condition:expr, $($message:tt)+) => {
        // Named, so that a comparison which NaN fails need not be written the other way round.
        let holds: bool = $condition;
        if !holds {
            return Err($crate::error::Error::Value(format!($($message)+)));
        }
    };
}
pub(crate) use ensure_value;
