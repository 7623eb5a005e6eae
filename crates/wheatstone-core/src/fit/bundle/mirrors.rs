//! Cameras that see charts the other way round: in a mirror, or with y of their pixels pointing up.
//!
//! No camera at any place sees a chart's front mirrored, so one lens model cannot explain such pictures beside ordinary ones.
//! With the sign of y changed they are those of a camera like any. The same is seen of a transparent chart from behind,
//! which a camera can do: so both are tried.

use super::{gather::Gathered, state::Shot};
use crate::geometry::{LEAST_ON_PLANE, Pixel, Point3};
use nalgebra::{Matrix2, Vector2};

/// The same with the sign of y changed in the pictures of the cameras that see charts the other way round from most; `None` where
/// all see them alike. With as many of either kind, it is those whose pixels' axes turn against the chart's.
pub(super) fn unmirrored(gathered: &Gathered) -> Option<Gathered> {
    let views = (0..gathered.shots.len()).filter(|view| !gathered.is_known(*view));
    let views: Vec<&Shot> = views.map(|view| &gathered.shots[view]).collect();
    // In how many more views a camera sees the chart the same way round than the other way.
    let senses: Vec<i32> = (0..gathered.cameras)
        .map(|camera| views.iter().map(|shot| sense(&shot[camera])).sum())
        .collect();
    let mirrored = senses.iter().filter(|sense| **sense < 0).count();
    let direct = senses.iter().filter(|sense| **sense > 0).count();
    if mirrored == 0 || direct == 0 {
        return None;
    }
    let odd = if mirrored <= direct { -1 } else { 1 };
    let mut turned = gathered.clone();
    for shot in &mut turned.shots {
        for (seen, _) in shot.iter_mut().zip(&senses).filter(|(_, sense)| sense.signum() == odd) {
            seen.iter_mut().for_each(|(_, pixel)| *pixel = Pixel::new(pixel.x, -pixel.y));
        }
    }
    Some(turned)
}

/// 1 where a picture turns from x to y as the chart does, -1 where it turns the other way, 0 where there is too little to tell.
fn sense(seen: &[(Point3, Pixel)]) -> i32 {
    if seen.len() < LEAST_ON_PLANE {
        return 0;
    }
    let share = 1.0 / seen.len() as f64;
    let (mut place, mut pixel) = (Vector2::zeros(), Vector2::zeros());
    for (on_chart, at) in seen {
        place += on_chart.xy().coords * share;
        pixel += at.coords * share;
    }
    // The affine map from chart to picture by least squares is this times a positive definite matrix.
    let common: Matrix2<f64> = seen
        .iter()
        .map(|(on_chart, at)| (at.coords - pixel) * (on_chart.xy().coords - place).transpose())
        .sum();
    common.determinant().partial_cmp(&0.0).map_or(0, |turns| turns as i32)
}
