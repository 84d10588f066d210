//! The SIMD instructions of this processor.
//!
//! Which there are is found when the program runs; `LIXEL_LANES=baseline` takes only those that every processor of
//! the kind has.

use fearless_simd::Level;
use std::sync::OnceLock;

pub fn level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(|| match std::env::var("LIXEL_LANES").as_deref() {
        Ok("baseline") => Level::baseline(),
        _ => Level::new(),
    })
}

/// What they are called.
pub fn level_name() -> &'static str {
    let level = format!("{:?}", level());
    let names = [
        ("Avx512", "AVX-512"),
        ("Avx2", "AVX2"),
        ("Sse4_2", "SSE4.2"),
        ("Sse2", "SSE2"),
        ("Neon", "NEON"),
    ];
    let known = names.iter().find(|(token, _)| level.contains(token));
    known.map_or("scalar", |(_, name)| name)
}
