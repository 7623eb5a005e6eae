//! Runs the tests of the Python package against the extension module that was built for this test, in an environment of
//! its own beside the build.
//!
//! Where there is no Python, or its packages cannot be had, it says so and passes; with `WHEATSTONE_PYTHON=required`, as in
//! continuous integration, it fails.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends where it cannot go on")]

use std::{
    env, fs,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// The oldest Python that the package is for.
const OLDEST: (u32, u32) = (3, 10);

/// What the tests are told.
struct Missing(String);

fn is_required() -> bool {
    env::var_os("WHEATSTONE_PYTHON").is_some_and(|value| value == "required")
}

/// Says something at once, whatever becomes of the test.
fn tell(text: &str) {
    std::io::stderr().write_all(format!("\n{text}\n").as_bytes()).unwrap();
}

/// Python's version, where the command is one.
fn version(python: &str) -> Option<(u32, u32)> {
    let code = "import sys; print(sys.version_info[0], sys.version_info[1])";
    let told = Command::new(python).args(["-c", code]).output().ok()?;
    let text = String::from_utf8(told.stdout).ok()?;
    let (major, minor) = text.trim().split_once(' ')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// The folder of the build, and the extension module in it.
fn built() -> (PathBuf, PathBuf) {
    let test = env::current_exe().unwrap();
    let folder = test.parent().unwrap();
    let name = format!("{}_wheatstone{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    let places = [folder.join(&name), folder.parent().unwrap().join(&name)];
    let module = places.into_iter().find(|path| path.is_file());
    let module = module.unwrap_or_else(|| panic!("{name} is not beside this test"));
    (folder.parent().unwrap().to_path_buf(), module)
}

/// An environment with the packages that the tests need: as it was, where these have not changed.
fn environment(folder: &Path, requirements: &Path) -> Result<PathBuf, Missing> {
    let candidates = ["python3", "python"];
    let python = candidates.into_iter().find(|python| version(python) >= Some(OLDEST));
    let (major, minor) = OLDEST;
    let python = python
        .ok_or_else(|| Missing(format!("there is no Python {major}.{minor} or newer here")))?;
    let bin = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let wanted = fs::read_to_string(requirements).unwrap();
    let stamp = folder.join("requirements.txt");
    if fs::read_to_string(&stamp).is_ok_and(|found| found == wanted) {
        return Ok(bin);
    }
    let made = Command::new(python).args(["-m", "venv", "--clear"]).arg(folder).output();
    if !made.is_ok_and(|made| made.status.success()) {
        return Err(Missing("this Python has no module `venv`".into()));
    }
    tell("installing what the tests of the Python package need");
    let mut pip = Command::new(bin.join("python"));
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"]);
    let told = pip.arg(requirements).stderr(Stdio::piped()).output().unwrap();
    if !told.status.success() {
        let last = String::from_utf8_lossy(&told.stderr).lines().last().unwrap_or("").to_owned();
        return Err(Missing(format!("the packages of its tests cannot be had: {last}")));
    }
    fs::write(stamp, wanted).unwrap();
    Ok(bin)
}

fn copied(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() && path.extension().is_none_or(|e| e != "so") {
            fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
        }
    }
}

#[test]
fn the_python_package() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (folder, module) = built();
    let folder = folder.join("python-package");
    let bin = match environment(&folder.join("venv"), &own.join("tests/requirements.txt")) {
        Ok(bin) => bin,
        Err(Missing(why)) if !is_required() => {
            tell(&format!("NOT TESTED: the Python package, for {why}"));
            return;
        }
        Err(Missing(why)) => panic!("the Python package cannot be tested: {why}"),
    };
    let site = folder.join("site");
    let package = site.join("wheatstone");
    if package.exists() {
        fs::remove_dir_all(&package).unwrap();
    }
    copied(&own.join("python/wheatstone"), &package);
    let end = if cfg!(windows) { "pyd" } else { "abi3.so" };
    fs::copy(module, package.join(format!("_wheatstone.{end}"))).unwrap();
    let mut tests = Command::new(bin.join("python"));
    tests.args([
        "-m",
        "pytest",
        "-v",
        "-p",
        "no:cacheprovider",
        "--durations=10",
        "--doctest-modules",
    ]);
    tests.args([own.join("tests"), package]).arg("-c").arg(own.join("pyproject.toml"));
    let program = site
        .parent()
        .unwrap()
        .parent()
        .unwrap()
        .join(format!("wheatstone{}", env::consts::EXE_SUFFIX));
    if program.is_file() {
        tests.env("WHEATSTONE_PROGRAM", program);
    }
    tests.env("PYTHONPATH", &site).env("PYTHONDONTWRITEBYTECODE", "1").current_dir(&folder);
    tell("running the tests of the Python package");
    // What they print is seen at once, so that a run that never ends tells where.
    let status = tests.status().unwrap();
    assert!(status.success(), "the tests of the Python package failed: {status}");
}
