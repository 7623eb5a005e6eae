//! The floor's edges as a compass: which way they run in the start frame, as far as that is known.

use crate::{
    Estimated,
    seeing::{FloorDirection, quarter},
    wrapped,
};

/// Which way the floor's edges run in the start frame, modulo a quarter turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heading {
    /// In radians.
    bearing: f64,
    variance: f64,
}

/// What is farther off than so many standard deviations is another floor, or none.
const FARTHEST: f64 = 3.5;

impl Heading {
    /// As a robot that knows its heading so observes it.
    pub(super) fn new(believed: &Estimated, seen: &FloorDirection) -> Self {
        Self {
            bearing: seen.bearing + believed.pose.heading,
            variance: seen.sigma * seen.sigma + believed.covariance.m33,
        }
    }

    /// The heading nearest to a guess under which the floor's edges run as they are seen.
    pub(super) fn nearest(&self, guess: f64, seen: &FloorDirection) -> f64 {
        wrapped(guess + quarter(self.bearing - seen.bearing - guess))
    }

    /// What a robot takes itself for that observes the floor's edges run so. It learns its heading from them
    /// where it knows it less well than their direction, and their direction from its heading where it
    /// knows it better: neither becomes surer of itself by what the other learnt from it.
    pub(super) fn corrected(
        &mut self,
        believed: &Estimated,
        seen: &FloorDirection,
    ) -> Option<Estimated> {
        let doubt = believed.covariance.m33;
        let noise = seen.sigma * seen.sigma;
        let off = quarter(self.bearing - seen.bearing - believed.pose.heading);
        if off * off > FARTHEST * FARTHEST * (self.variance + noise + doubt) {
            return None;
        }
        if doubt <= self.variance {
            let gain = self.variance / (self.variance + noise + doubt);
            self.bearing = quarter(self.bearing - gain * off);
            // No surer than the heading that it was learnt by.
            self.variance = ((1.0 - gain) * self.variance).max(doubt);
            return None;
        }
        let least = doubt * self.variance / (doubt - self.variance);
        let along = believed.covariance.column(2).into_owned();
        let gain = along / (doubt + noise.max(least));
        let mut pose = believed.pose;
        pose.x += gain[0] * off;
        pose.z += gain[1] * off;
        pose.heading = wrapped(pose.heading + gain[2] * off);
        Some(Estimated { pose, covariance: believed.covariance - gain * along.transpose() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlanarPose;
    use nalgebra::Matrix3;

    fn believed(heading: f64, sigma: f64) -> Estimated {
        let mut covariance = Matrix3::identity();
        covariance[(2, 2)] = sigma * sigma;
        Estimated { pose: PlanarPose { x: 5.0, z: 50.0, heading }, covariance }
    }

    #[test]
    fn a_heading_lost_is_found_again() {
        let seen = |heading: f64| FloorDirection { bearing: quarter(0.3 - heading), sigma: 0.005 };
        let mut heading = Heading::new(&believed(0.0, 0.0), &seen(0.0));
        // Half a turn later, and three quarters.
        for truth in [0.2, 3.0, -1.7] {
            let found = heading.corrected(&believed(truth + 0.12, 0.1), &seen(truth)).unwrap();
            assert!((found.pose.heading - truth).abs() < 0.002, "{truth}: {found:?}");
            let sigma = found.covariance.m33.sqrt();
            // As sure as the floor's direction is, and no surer.
            assert!((sigma - 0.005).abs() < 1e-9, "{sigma}");
        }
        // Who is sure of himself does not believe a floor that lies far otherwise.
        assert!(heading.corrected(&believed(0.3, 0.01), &seen(0.0)).is_none());
    }

    #[test]
    fn the_heading_nearest_to_a_guess_is_whole_quarter_turns_from_what_the_floor_says() {
        let seen = |heading: f64| FloorDirection { bearing: quarter(0.3 - heading), sigma: 0.005 };
        let heading = Heading::new(&believed(0.0, 0.0), &seen(0.0));
        for truth in [0.2, 1.5, 3.1, -1.7] {
            for error in [-0.3, 0.1, 0.6] {
                let found = heading.nearest(truth + error, &seen(truth));
                assert!(wrapped(found - truth).abs() < 1e-9, "{truth} {error}: {found}");
            }
        }
    }

    #[test]
    fn a_sure_heading_teaches_the_direction() {
        let mut heading =
            Heading::new(&believed(0.0, 0.0), &FloorDirection { bearing: 0.32, sigma: 0.02 });
        for _ in 0..20 {
            let seen = FloorDirection { bearing: 0.30, sigma: 0.02 };
            assert!(heading.corrected(&believed(0.0, 0.001), &seen).is_none());
        }
        assert!((heading.bearing - 0.30).abs() < 0.002, "{}", heading.bearing);
        assert!(heading.variance < 0.006 * 0.006 && heading.variance >= 1e-6);
    }
}
