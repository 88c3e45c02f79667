//! From a description to a controller and the plant it does not quite know.

use crate::error::ExperimentError;
use crate::mismatch::Mismatch;
use supple_core::config::Law;
use supple_core::{Config, Friction};
use supple_model::Description;
use supple_plant::{LuGre, PlantConfig, Scene};

/// Noise of the force sensor, on each reported component \[N\].
const FORCE_NOISE_N: f64 = 0.02;

/// How the controller of a run differs from the plant, and from the default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// Errors of the model; `None` knows the plant's parameters.
    pub mismatch: Option<Mismatch>,
    /// The friction feed-forward has the plant's Stribeck dip; without, it is (3.2).
    pub stribeck: bool,
    /// The plant's friction has its part that depends on direction and load.
    pub load: bool,
    /// The contact latch fades the friction feed-forward.
    pub fade: bool,
    /// The law is (3.6) to the letter.
    pub paper_letter: bool,
}

impl Variant {
    /// The unperturbed model, Stribeck feed-forward, load-dependent friction in the
    /// plant, fade on.
    pub const EXACT: Variant = Variant {
        mismatch: None,
        stribeck: true,
        load: true,
        fade: true,
        paper_letter: false,
    };
}

/// The plant of a description and what a controller is told about it.
#[derive(Clone, Debug)]
pub struct Setup<const N: usize> {
    exact: Config<N>,
    plant: PlantConfig<N>,
    /// `exact` is a model that was found, with a dip of its own or none.
    identified: bool,
}

impl<const N: usize> Setup<N> {
    /// The plant of one description, driven by a controller that knows another.
    ///
    /// # Errors
    /// Where one of the descriptions does not have `N` joints.
    pub fn with_model(
        description: &Description,
        model: &Description,
        seed: u64,
    ) -> Result<Setup<N>, ExperimentError> {
        let mut setup = Setup::new(description, seed)?;
        setup.exact = model.config::<N>()?;
        setup.identified = true;
        Ok(setup)
    }

    /// Takes the description as the truth about the plant. Where its friction has no Stribeck dip, the
    /// plant's breakaway is 10 % above Coulomb all the same.
    ///
    /// # Errors
    /// Where the description does not have `N` joints.
    pub fn new(description: &Description, seed: u64) -> Result<Setup<N>, ExperimentError> {
        let exact = description.config::<N>()?;
        let mut plant = PlantConfig::from_description(description)?;
        plant.force_sensor.noise_n = FORCE_NOISE_N;
        plant.seed = seed;
        Ok(Setup {
            exact,
            plant,
            identified: false,
        })
    }

    /// Radius of the cap \[m\].
    pub fn tip_radius_m(&self) -> f64 {
        self.plant.tip_radius_m
    }

    /// The controller's configuration in a variant.
    ///
    /// # Errors
    /// Where the mismatch leaves no physical arm.
    pub fn config(&self, variant: &Variant) -> Result<Config<N>, ExperimentError> {
        let mut config = self.exact;
        for (friction, truth) in config.friction.iter_mut().zip(&self.plant.friction) {
            let breakaway_nm = match (variant.stribeck, self.identified) {
                (false, _) => friction.coulomb_nm,
                (true, false) => truth.breakaway_nm,
                (true, true) => friction.breakaway_nm,
            };
            *friction = Friction {
                breakaway_nm,
                ..*friction
            };
        }
        if let (Some(mismatch), false) = (&variant.mismatch, self.identified) {
            config = mismatch.apply(&config)?;
        }
        config.latch.fade = variant.fade;
        if variant.paper_letter {
            config.law = Law::paper_letter(config.law.gains);
            config.latch.fade = false;
        }
        Ok(config)
    }

    /// The plant in a variant, with a scene around it.
    pub fn plant(&self, variant: &Variant, scene: Scene) -> PlantConfig<N> {
        let mut plant = self.plant.clone();
        if !variant.load {
            plant.friction = plant.friction.map(LuGre::without_load);
        }
        plant.scene = scene;
        plant
    }
}
