//! Logarithmic perspective shadow map: columns narrow along the view as the pixels do, and rows do, too.
//!
//! A perspective across the light, whose rows are spread by a logarithm of the distance from its apex.
//!
//! D. Brandon Lloyd, Naga K. Govindaraju, Cory Quammen, Steven E. Molnar, Dinesh Manocha. Logarithmic
//! perspective shadow maps. ACM Transactions on Graphics 27(4), 2008, for one map of the view frustum.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`.
//!
//! Limits: the more the light shines along the view the less there is to gain; along it the map is
//! the focused one. Around a light that is near the map is that of light space perspective.

use super::prelude::*;
use crate::fits::log_perspective::fit_log_perspectives;

parameters! {
    pub struct LogPerspective {
        pub map: MapParameters,
        pub fitting: FitParameters,
    }
}

impl ShadowMethod for LogPerspective {
    const NAME: &'static str = "log_psm";
    const TITLE: &'static str = "Logarithmic perspective";
    const CITATION: &'static str = "Lloyd, D. B., Govindaraju, N. K., Quammen, C., Molnar, S. E., and \
         Manocha, D. 2008. Logarithmic perspective shadow maps. ACM Transactions on Graphics 27(4).";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl LogPerspective {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        fit_log_perspectives(view, self.fitting.target(size))
    }
}
