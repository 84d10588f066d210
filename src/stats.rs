//! What a frame counts, and what its passes do.

use crate::scene::Scene;

/// A number that a pass counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fact {
    pub name: &'static str,
    pub value: u64,
    /// Whether the greatest of all layers counts, or else their sum.
    is_maximum: bool,
}

pub type Facts = Vec<Fact>;

impl Fact {
    /// A number that adds up over layers.
    pub fn sum(name: &'static str, value: u32) -> Self {
        Self {
            name,
            value: value.into(),
            is_maximum: false,
        }
    }

    /// A number of which the greatest of all layers counts.
    pub fn maximum(name: &'static str, value: u32) -> Self {
        Self {
            is_maximum: true,
            ..Self::sum(name, value)
        }
    }
}

/// Facts by the label of their pass.
#[derive(Debug, Clone, Default)]
pub struct FactsOfPasses(pub Vec<(&'static str, Facts)>);

impl FactsOfPasses {
    /// Merges facts with those of the same name that the pass has from other layers.
    pub fn add(&mut self, label: &'static str, facts: Facts) {
        let known = match self.0.iter().position(|(known, _)| *known == label) {
            Some(known) => known,
            None => {
                self.0.push((label, Vec::new()));
                self.0.len() - 1
            }
        };
        let known = &mut self.0[known].1;
        for fact in facts {
            match known.iter_mut().find(|known| known.name == fact.name) {
                None => known.push(fact),
                Some(known) => {
                    known.value = match fact.is_maximum {
                        true => known.value.max(fact.value),
                        false => known.value + fact.value,
                    }
                }
            }
        }
    }
}

/// Pixels, where a method counts them.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReceiverCounts {
    /// Those that see a surface.
    pub seen: u32,
    /// Those whose surface faces the light; one at the border of two layers is counted in both.
    pub facing: u32,
}

/// What a frame counts.
#[derive(Debug, Clone, Default)]
pub struct Stats {
    pub triangles: usize,
    pub degenerate_triangles: usize,
    /// Of passes, by their labels.
    pub facts: FactsOfPasses,
    /// Where a method counts them.
    pub receivers: Option<ReceiverCounts>,
    /// Stages that this frame did not need.
    pub skipped: Vec<&'static str>,
    pub layers: usize,
    /// Layers that no receiver fell in.
    pub skipped_layers: usize,
    /// What the method measured, by name.
    pub measures: Vec<(&'static str, f64)>,
}

impl Stats {
    pub fn new(scene: &Scene) -> Self {
        Self {
            triangles: scene.triangles().len(),
            degenerate_triangles: scene.degenerate_count(),
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_add_up_and_the_longest_list_is_the_longest_of_all() {
        let mut facts = FactsOfPasses::default();
        for (receivers, longest) in [(3, 2), (4, 9), (5, 1)] {
            let of_layer = [
                Fact::sum("receivers", receivers),
                Fact::maximum("longest_list", longest),
            ];
            facts.add("lists", of_layer.to_vec());
        }
        facts.add("lists", vec![Fact::sum("tests", 7)]);
        let [(label, facts)] = &facts.0[..] else {
            panic!("one pass, got {facts:?}");
        };
        let facts: Vec<_> = facts.iter().map(|fact| (fact.name, fact.value)).collect();
        assert_eq!(*label, "lists");
        assert_eq!(
            facts,
            [("receivers", 12), ("longest_list", 9), ("tests", 7)]
        );
    }
}
