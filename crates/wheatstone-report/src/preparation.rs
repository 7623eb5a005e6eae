//! What was done to the data before the fit, as the report shows it.

use super::sections::{FindingFigures, OutlierFigures, StageFigures};
use wheatstone_core::{
    fit::stage::ViewOffset,
    preparation::{SavedFinding, SetAside},
};

pub(super) fn outlier(point: &SetAside) -> OutlierFigures {
    let camera = match point.cameras.as_slice() {
        [one] => Some(one - 1),
        _ => None,
    };
    OutlierFigures {
        view: point.view.clone(),
        id: point.id.clone(),
        camera,
        reason: format!("{:.1} px reprojection error", point.residual),
    }
}

pub(super) fn stage(view: &ViewOffset) -> StageFigures {
    let variance: f64 = view.sigma.iter().map(|sigma| sigma * sigma).sum();
    StageFigures {
        view: view.view.clone(),
        offset: view.offset,
        rotation: view.rotation,
        sigma: Some((variance / 3.0).sqrt()),
    }
}

pub(super) fn finding(found: &SavedFinding) -> FindingFigures {
    let severity = match found.severity.as_str() {
        _ if found.repaired => "note",
        "fatal" => "error",
        "warning" => "warning",
        _ => "note",
    };
    let repaired = if found.repaired { "corrected before the fit: " } else { "" };
    FindingFigures {
        code: found.code.clone(),
        severity: severity.into(),
        views: found.views.clone(),
        cameras: found.cameras.iter().map(|camera| format!("camera {camera}")).collect(),
        explanation: format!("{repaired}{}", found.explanation),
        hint: found.hint.clone(),
        stays_in_fit: found.stays_in_fit,
    }
}
