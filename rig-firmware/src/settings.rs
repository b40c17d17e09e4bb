//! The `$` settings: what there is, what is allowed.
//!
//! Values are kept as they are spoken: whole numbers and flags as they are, decimals in
//! thousandths. Knows nothing of where they are stored.

use crate::board::Outputs;
use crate::error::Error;
use crate::number::Decimal;
use crate::ramp::{MAX_STEP_RATE, Profile, TICKS_PER_SECOND};
use crate::stepper::StepperSettings;

/// How many settings there are.
pub(crate) const COUNT: usize = 20;

/// A setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Key {
    /// `$0`: length of a step pulse, us.
    StepPulse,
    /// `$1`: rest after which the driver is released, ms; 255: never.
    ReleaseDelay,
    /// `$2`: step pulses are low.
    InvertStep,
    /// `$3`: the direction pin is high for a positive turn instead of low.
    InvertDirection,
    /// `$4`: the enable pin is inverted.
    InvertEnable,
    /// `$5`: the index input is active when open (high) instead of closed (low).
    InvertIndex,
    /// `$14`: the emergency-stop input is active when open (high) instead of closed (low).
    InvertEmergency,
    /// `$20`: soft limits are on.
    SoftLimits,
    /// `$22`: homing is on.
    Homing,
    /// `$23`: the index is looked for in negative direction.
    HomingInverted,
    /// `$24`: speed of the last approach to the index, degrees/min.
    HomingFeed,
    /// `$25`: speed of the search for the index, degrees/min.
    HomingSeek,
    /// `$26`: time for which the index has to stay, ms.
    HomingDebounce,
    /// `$27`: distance from the index at which its last approach begins, degrees.
    HomingPullOff,
    /// `$60`: silence of the host after which a moving table stops, s; 0: never.
    Lease,
    /// `$61`: volts at the battery input's full scale.
    BatteryScale,
    /// `$100`: steps/degree.
    StepsPerDegree,
    /// `$110`: highest speed, degrees/min.
    MaxFeed,
    /// `$120`: acceleration, degrees/s^2.
    Acceleration,
    /// `$130`: soft limit either way from machine zero, degrees.
    Travel,
}

/// What a setting's value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A whole number.
    Whole,
    /// Thousandths.
    Decimal,
}

/// What a setting may be.
struct Spec {
    number: u8,
    kind: Kind,
    default: i32,
    least: i32,
    most: i32,
}

const fn whole(number: u8, default: i32, least: i32, most: i32) -> Spec {
    Spec {
        number,
        kind: Kind::Whole,
        default,
        least,
        most,
    }
}

const fn flag(number: u8, default: i32) -> Spec {
    whole(number, default, 0, 1)
}

const fn decimal(number: u8, default: i32, least: i32, most: i32) -> Spec {
    Spec {
        number,
        kind: Kind::Decimal,
        default,
        least,
        most,
    }
}

impl Key {
    /// All settings in the order of their numbers.
    pub(crate) const ALL: [Key; COUNT] = [
        Key::StepPulse,
        Key::ReleaseDelay,
        Key::InvertStep,
        Key::InvertDirection,
        Key::InvertEnable,
        Key::InvertIndex,
        Key::InvertEmergency,
        Key::SoftLimits,
        Key::Homing,
        Key::HomingInverted,
        Key::HomingFeed,
        Key::HomingSeek,
        Key::HomingDebounce,
        Key::HomingPullOff,
        Key::Lease,
        Key::BatteryScale,
        Key::StepsPerDegree,
        Key::MaxFeed,
        Key::Acceleration,
        Key::Travel,
    ];

    /// The number after `$`.
    pub(crate) fn number(self) -> u8 {
        self.spec().number
    }

    /// What the value is.
    pub(crate) fn kind(self) -> Kind {
        self.spec().kind
    }

    /// The setting of a number.
    pub(crate) fn from_number(number: u32) -> Option<Key> {
        Key::ALL
            .into_iter()
            .find(|key| u32::from(key.number()) == number)
    }

    /// A match and not a table: constants of a table would lie in the chip's memory.
    fn spec(self) -> Spec {
        match self {
            Key::StepPulse => whole(0, 10, 3, 100),
            Key::ReleaseDelay => whole(1, 250, 0, 255),
            Key::InvertStep => flag(2, 0),
            Key::InvertDirection => flag(3, 0),
            Key::InvertEnable => flag(4, 0),
            Key::InvertIndex => flag(5, 0),
            Key::InvertEmergency => flag(14, 0),
            Key::SoftLimits => flag(20, 1),
            Key::Homing => flag(22, 0),
            Key::HomingInverted => flag(23, 0),
            Key::HomingFeed => decimal(24, 72_000, 1000, 100_000_000),
            Key::HomingSeek => decimal(25, 720_000, 1000, 100_000_000),
            Key::HomingDebounce => whole(26, 20, 0, 1000),
            Key::HomingPullOff => decimal(27, 2000, 100, 90_000),
            Key::Lease => whole(60, 0, 0, 600),
            Key::BatteryScale => decimal(61, 15_500, 1, 100_000),
            Key::StepsPerDegree => decimal(100, 88_889, 100, 1_000_000),
            Key::MaxFeed => decimal(110, 2_160_000, 1000, 100_000_000),
            Key::Acceleration => decimal(120, 36_000, 10, 100_000_000),
            Key::Travel => decimal(130, 400_000, 1, 1_000_000_000),
        }
    }
}

/// The values of all settings, each within its bounds and all fit for one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GrblSettings {
    values: [i32; COUNT],
}

impl GrblSettings {
    /// The values of a new table.
    pub(crate) fn defaults() -> GrblSettings {
        GrblSettings {
            values: Key::ALL.map(|key| key.spec().default),
        }
    }

    /// From stored values; `None` if one is not allowed.
    pub(crate) fn from_values(values: [i32; COUNT]) -> Option<GrblSettings> {
        let settings = GrblSettings { values };
        let allowed = Key::ALL.into_iter().all(|key| {
            let spec = key.spec();
            (spec.least..=spec.most).contains(&settings.get(key))
        });
        (allowed && settings.check().is_ok()).then_some(settings)
    }

    /// All values, in the order of [`Key::ALL`].
    pub(crate) fn values(&self) -> &[i32; COUNT] {
        &self.values
    }

    /// A value: decimals in thousandths.
    pub(crate) fn get(&self, key: Key) -> i32 {
        self.values.get(key as usize).copied().unwrap_or(0)
    }

    /// A value that is not negative by its bounds.
    pub(crate) fn amount(&self, key: Key) -> u32 {
        self.get(key).unsigned_abs()
    }

    /// A flag.
    pub(crate) fn flag(&self, key: Key) -> bool {
        self.get(key) != 0
    }

    /// Sets a value.
    ///
    /// # Errors
    /// [`Error::Negative`]; [`Error::StepPulse`] for pulses shorter than 3 us; [`Error::BadNumber`]
    /// for any other value out of bounds or a fraction where a whole number belongs;
    /// [`Error::StepRate`] if the highest speed would be more than 10 000 steps/s. Nothing
    /// changes then.
    pub(crate) fn set(&mut self, key: Key, value: Decimal) -> Result<(), Error> {
        let spec = key.spec();
        if value.is_negative() {
            return Err(Error::Negative);
        }
        let value = match spec.kind {
            Kind::Decimal => value.thousandths(),
            Kind::Whole if !value.is_whole() => None,
            Kind::Whole => i32::try_from(value.whole()).ok(),
        };
        let value = value.ok_or(Error::BadNumber)?;
        if key == Key::StepPulse && value < spec.least {
            return Err(Error::StepPulse);
        }
        if !(spec.least..=spec.most).contains(&value) {
            return Err(Error::BadNumber);
        }
        let mut changed = *self;
        if let Some(place) = changed.values.get_mut(key as usize) {
            *place = value;
        }
        changed.check()?;
        *self = changed;
        Ok(())
    }

    /// What must hold between settings: the step rate, and an acceleration that ramps can follow.
    fn check(&self) -> Result<(), Error> {
        let steps = u64::from(self.amount(Key::StepsPerDegree));
        let rate = steps * u64::from(self.amount(Key::MaxFeed));
        if rate > u64::from(MAX_STEP_RATE) * 60 * 1_000_000 {
            return Err(Error::StepRate);
        }
        // Between 1 step/s^2 and a million.
        let acceleration = steps * u64::from(self.amount(Key::Acceleration));
        if !(1_000_000..=1_000_000_000_000).contains(&acceleration) {
            return Err(Error::BadNumber);
        }
        Ok(())
    }

    /// The motion limits.
    pub(crate) fn profile(&self) -> Profile {
        Profile::new(
            self.amount(Key::StepsPerDegree),
            self.amount(Key::Acceleration),
        )
    }

    /// What the board has to know.
    pub(crate) fn outputs(&self) -> Outputs {
        Outputs {
            pulse_us: self.amount(Key::StepPulse) as u8,
            invert_step: self.flag(Key::InvertStep),
            invert_direction: self.flag(Key::InvertDirection),
            invert_enable: self.flag(Key::InvertEnable),
        }
    }

    /// What the stepper has to know.
    pub(crate) fn stepper(&self, profile: &Profile) -> StepperSettings {
        StepperSettings {
            first_interval: profile.first_interval(),
            invert_index: self.flag(Key::InvertIndex),
            invert_emergency: self.flag(Key::InvertEmergency),
            debounce: self.amount(Key::HomingDebounce) * (TICKS_PER_SECOND / 1000),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_allowed_and_found_by_their_numbers() {
        let defaults = GrblSettings::defaults();
        assert_eq!(GrblSettings::from_values(defaults.values), Some(defaults));
        for (place, key) in Key::ALL.into_iter().enumerate() {
            assert_eq!(key as usize, place);
            assert_eq!(Key::from_number(u32::from(key.number())), Some(key));
        }
        assert_eq!(Key::from_number(6), None);
        assert_eq!(Key::from_number(256), None);
    }

    #[test]
    fn values_out_of_bounds_are_refused_and_change_nothing() {
        let mut settings = GrblSettings::defaults();
        let cases = [
            (Key::StepPulse, "2", Error::StepPulse),
            (Key::StepPulse, "101", Error::BadNumber),
            (Key::ReleaseDelay, "-1", Error::Negative),
            (Key::ReleaseDelay, "1.5", Error::BadNumber),
            (Key::SoftLimits, "2", Error::BadNumber),
            (Key::MaxFeed, "6751", Error::StepRate),
            (Key::StepsPerDegree, "300", Error::StepRate),
            (Key::StepsPerDegree, "999999999", Error::BadNumber),
            (Key::Acceleration, "0.01", Error::BadNumber),
            (Key::Travel, "0", Error::BadNumber),
        ];
        for (key, text, error) in cases {
            let (value, _) = crate::number::parse(text.as_bytes()).unwrap();
            assert_eq!(settings.set(key, value), Err(error), "{key:?}");
        }
        assert_eq!(settings, GrblSettings::defaults());
    }

    #[test]
    fn stored_values_that_do_not_fit_one_another_are_not_taken() {
        let mut values = GrblSettings::defaults().values;
        values[Key::MaxFeed as usize] = 100_000_000;
        assert_eq!(GrblSettings::from_values(values), None);
    }
}
