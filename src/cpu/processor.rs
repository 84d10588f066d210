//! What the processor is called.

use std::sync::OnceLock;

/// By its maker's words where the system tells them, else by its kind of instructions.
pub fn name() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let told = std::fs::read_to_string("/proc/cpuinfo").ok();
        told.and_then(|text| model_name(&text))
            .or_else(|| std::env::var("PROCESSOR_IDENTIFIER").ok())
            .unwrap_or_else(|| format!("{} processor", std::env::consts::ARCH))
    })
}

/// That of the first processor in Linux's list.
fn model_name(text: &str) -> Option<String> {
    let mut fields = text.lines().filter_map(|line| line.split_once(':'));
    let (_, name) = fields.find(|(field, _)| field.trim() == "model name")?;
    Some(name.trim().to_string()).filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_is_read_from_a_list() {
        let text = "processor\t: 0\nmodel\t\t: 1\nmodel name\t: A Processor: 3 GHz\n\nprocessor: 1";
        assert_eq!(model_name(text).as_deref(), Some("A Processor: 3 GHz"));
        assert_eq!(model_name("Hardware : board"), None);
        assert!(!name().is_empty());
    }
}
