//! The unit of cameras' lengths: the one that a file says, that its format has, and that is wanted.

use super::{Given, InputFile, Rig};
use wheatstone_core::{
    Result,
    error::{Hint, Remedy},
    unit,
};

/// Cameras in the unit that was given: converted to it where the file or its format says another.
pub(super) fn in_given(mut rig: Rig, given: &Given, file: &InputFile) -> Result<Rig> {
    let mut units = rig.unit.iter().chain(&given.unit);
    if let Some(other) = units.find(|name| unit::is_of_other_kind(name)) {
        let problem = format!("`{other}` is given for the unit of lengths");
        return Err(file.error(0, problem, "give a unit such as mm"));
    }
    let Some(wanted) = given.unit.as_deref() else { return Ok(rig) };
    let Some(own) = rig.unit.as_deref() else {
        rig.unit = Some(wanted.into());
        return Ok(rig);
    };
    if own != wanted && unit::factor(own, wanted).is_none() {
        let problem = format!("lengths in `{own}` do not convert to `{wanted}`");
        let known = unit::names().collect::<Vec<_>>().join(", ");
        let hint = Hint::new(format!("units that convert are {known}"), Remedy::Unit);
        return Err(file.error(0, problem, hint));
    }
    rig.in_unit(wanted, "cameras")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Format;

    const KALIBR: &str = "cam0:
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [900.0, 900.0, 320.0, 240.0]
  resolution: [640, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.25]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [900.0, 900.0, 320.0, 240.0]
  resolution: [640, 480]
";

    /// Where the second camera stands, and in which unit, as it is read with a unit that is given.
    fn second(name: &str, text: &str, unit: Option<&str>) -> Result<(f64, Option<String>)> {
        let file = InputFile { path: "rig".into(), bytes: text.into() };
        let given = Given { unit: unit.map(Into::into), ..Given::default() };
        let rig = Format::named(name)?.read_rig(&[file], &given)?;
        Ok((rig.cameras[1].optics.pose().unwrap().translation.x, rig.unit))
    }

    #[test]
    fn a_given_unit_converts_what_says_its_own_and_names_what_does_not() {
        let said = |unit: &str| Some(unit.to_owned());
        let kalibr = |unit| second("kalibr", KALIBR, unit).unwrap();
        assert_eq!(kalibr(None), (-0.25, said("m")));
        assert_eq!(kalibr(Some("mm")), (-250.0, said("mm")));
        let rig = Format::named("kalibr").unwrap();
        let file = InputFile { path: "rig".into(), bytes: KALIBR.into() };
        let rig = rig.read_rig(&[file], &Given::default()).unwrap();
        let text = |unit: Option<String>| {
            let files = Format::named("opencv").unwrap().write_rig(&Rig { unit, ..rig.clone() });
            String::from_utf8(files.unwrap().remove(0).bytes).unwrap()
        };
        let (metres, silent) = (text(said("m")), text(None));
        assert_eq!(second("opencv", &metres, Some("cm")).unwrap(), (-25.0, said("cm")));
        assert_eq!(second("opencv", &silent, Some("cm")).unwrap(), (-0.25, said("cm")));
        assert_eq!(second("opencv", &silent, None).unwrap(), (-0.25, None));
        let error = second("opencv", &metres, Some("cubit")).unwrap_err();
        assert_eq!(error.to_string(), "rig: lengths in `m` do not convert to `cubit`");
        let error = second("opencv", &silent, Some("px")).unwrap_err();
        assert_eq!(error.to_string(), "rig: `px` is given for the unit of lengths");
    }
}
