//! Builds plant and controller from a description; the controller's model may differ from the plant.

use crate::error::ExperimentError;
use crate::mismatch::Mismatch;
use supple_core::config::Law;
use supple_core::{Config, Friction};
use supple_model::{Description, Paths};
use supple_plant::{LuGre, PlantConfig, PlantOptions, Scene};

/// Noise of the force sensor, on each reported component \[N\].
const FORCE_NOISE_N: f64 = 0.02;

/// Deviations of a run's controller and plant from the default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// Errors of the model; `None` uses the plant's parameters.
    pub mismatch: Option<Mismatch>,
    /// Whether the friction feed-forward includes the plant's Stribeck effect; otherwise it is (3.2).
    pub stribeck: bool,
    /// Whether the plant's friction depends on direction and load.
    pub load: bool,
    /// Whether the contact latch fades the friction feed-forward.
    pub fade: bool,
    /// Whether the law is equation (3.6) exactly as printed.
    pub law_as_printed: bool,
}

impl Variant {
    /// The unperturbed model, Stribeck feed-forward, load-dependent friction in the
    /// plant, and fading of the friction feed-forward in contact.
    pub const EXACT: Variant = Variant {
        mismatch: None,
        stribeck: true,
        load: true,
        fade: true,
        law_as_printed: false,
    };
}

/// The plant of a description and the model of its controller.
#[derive(Clone, Debug)]
pub struct Setup<const N: usize> {
    exact: Config<N>,
    plant: PlantConfig<N>,
    /// Friction of the plant without options, which is the friction of a model identified without options.
    described_friction: [LuGre; N],
    /// Whether `exact` is an identified model, which has its own Stribeck effect.
    identified: bool,
    paths: Paths,
}

impl<const N: usize> Setup<N> {
    /// Creates the plant of one description with a controller whose model is another description.
    ///
    /// # Errors
    /// If one of the descriptions does not have `N` joints.
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

    /// Creates plant and controller of one description. If its friction has no Stribeck effect, the plant's breakaway
    /// torque is nevertheless 10 % above Coulomb friction.
    ///
    /// # Errors
    /// If the description does not have `N` joints.
    pub fn new(description: &Description, seed: u64) -> Result<Setup<N>, ExperimentError> {
        let exact = description.config::<N>()?;
        let mut plant = PlantConfig::from_description(description)?;
        plant.force_sensor.noise_n = FORCE_NOISE_N;
        plant.seed = seed;
        Ok(Setup {
            exact,
            described_friction: plant.friction,
            plant,
            identified: false,
            paths: description.paths(),
        })
    }

    /// Adds effects of a real arm to the plant; the controller's model does not change.
    ///
    /// # Errors
    /// If the options do not fit the arm.
    pub fn with_plant_options(mut self, options: &PlantOptions) -> Result<Self, ExperimentError> {
        self.plant = options.apply(self.plant)?;
        Ok(self)
    }

    /// Returns place and size of the trajectories.
    pub fn paths(&self) -> Paths {
        self.paths
    }

    /// Sets place and size of the trajectories.
    #[must_use]
    pub fn with_paths(self, paths: Paths) -> Self {
        Setup { paths, ..self }
    }

    /// Returns the radius of the cap \[m\].
    pub fn tip_radius_m(&self) -> f64 {
        self.plant.tip_radius_m
    }

    /// Returns the controller's configuration for a variant.
    ///
    /// # Errors
    /// If the mismatch makes the arm physically inconsistent.
    pub fn config(&self, variant: &Variant) -> Result<Config<N>, ExperimentError> {
        let mut config = self.exact;
        for (friction, truth) in config.friction.iter_mut().zip(&self.described_friction) {
            let breakaway_nm = match (variant.stribeck, self.identified) {
                (false, _) => friction.coulomb_nm,
                (true, false) => truth.breakaway_nm,
                (true, true) => friction.breakaway_nm,
            };
            *friction = Friction {
                breakaway_nm,
                stribeck_offset_nm: match variant.stribeck {
                    true => friction.stribeck_offset_nm,
                    false => 0.0,
                },
                ..*friction
            };
        }
        if let (Some(mismatch), false) = (&variant.mismatch, self.identified) {
            config = mismatch.apply(&config)?;
        }
        config.latch.fade = variant.fade;
        if variant.law_as_printed {
            config.law = Law::as_published(config.law.gains);
            config.latch.fade = false;
        }
        Ok(config)
    }

    /// Returns the plant for a variant, with a scene.
    pub fn plant(&self, variant: &Variant, scene: Scene) -> PlantConfig<N> {
        let mut plant = self.plant.clone();
        if !variant.load {
            plant.friction = plant.friction.map(LuGre::without_load);
        }
        plant.scene = scene;
        plant
    }
}
