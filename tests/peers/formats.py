"""Reads what `wheatstone export` writes with the programs that the formats belong to, and compares pixels.

    python3 -m venv venv && venv/bin/pip install opencv-python-headless pycolmap aniposelib pyyaml numpy pyarrow pandas
    venv/bin/python tests/peers/formats.py target/release/wheatstone

Cameras with known numbers go in as OpenCV files, become a model, and leave in every format; each tool then
projects the same points, and so do numpy's own few lines for formats whose tools are not on PyPI (Kalibr,
mrcal, ROS, DLT). The largest difference from cv2.projectPoints is printed a format; more than 1e-6 px fails.
"""
import ast, json, pathlib, subprocess, sys, tempfile
import cv2, numpy as np, yaml

program = pathlib.Path(sys.argv[1]).resolve()
work = pathlib.Path(tempfile.mkdtemp())
rng = np.random.default_rng(3)
SIZES = [(1280, 1024), (1280, 1024), (1600, 1200)]
K = [np.array([[f, 0, cx], [0, g, cy], [0, 0, 1.0]])
     for f, g, cx, cy in [(1100.25, 1102.5, 633.1, 517.7), (1093.0, 1090.75, 641.9, 509.2), (1203.5, 1207.0, 799.1, 601.3)]]
D = {
    4: [[-0.21, 0.083, 1.1e-3, -4e-4], [-0.2, 0.07, -9e-4, 3e-4], [-0.15, 0.05, 1e-4, 2e-4]],
    5: [[-0.21, 0.083, 1.1e-3, -4e-4, -0.013], [-0.2, 0.07, -9e-4, 3e-4, 0.011], [-0.15, 0.05, 1e-4, 2e-4, -0.02]],
    8: [[0.31, -0.12, 1e-3, -4e-4, 0.02, 0.52, -0.11, 0.01]] * 3,
    12: [[0.31, -0.12, 1e-3, -4e-4, 0.02, 0.52, -0.11, 0.01, 2e-3, -1e-3, 3e-3, 5e-4]] * 3,
    "fisheye": [[-0.021, 0.0042, -0.0031, 0.00047], [-0.02, 0.004, -0.003, 0.0005], [0.01, -0.002, 0.001, -2e-4]],
    0: [[0.0] * 5] * 3,
}
RVEC = [np.array([0.1, -0.2, 0.05]), np.array([0.08, 0.15, -0.03]), np.array([-0.2, 0.02, 0.3])]
TVEC = [np.array([30.0, -20.0, 900.0]), np.array([-170.0, 12.5, 930.0]), np.array([-5.5, 140.0, 1010.0])]
WORLD = np.column_stack([rng.uniform(-200, 200, 200), rng.uniform(-150, 150, 200), rng.uniform(-100, 150, 200)])


def pixels(kind, k, d, rvec, tvec, world):
    world = np.ascontiguousarray(world, dtype=np.float64)[:, None]
    if kind == "fisheye":
        return cv2.fisheye.projectPoints(world, rvec, tvec, k, np.array(d))[0][:, 0]
    return cv2.projectPoints(world, rvec, tvec, k, np.array(d))[0][:, 0]


def run(*arguments, fails=False):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if (done.returncode != 0) != fails:
        sys.exit(f"{arguments}: {done.stderr}")
    return done


def model(kind, count):
    """A model from an OpenCV file that OpenCV itself writes."""
    path = work / f"in-{kind}-{count}.yml"
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    poses = [np.hstack([cv2.Rodrigues(r)[0], t[:, None]]) for r, t in zip(RVEC, TVEC)]
    for i in range(count):
        store.write(f"K{i+1}", K[i])
        store.write(f"D{i+1}", np.array(D[kind][i]))
        store.write(f"camera_from_world_{i+1}", poses[i])
    store.release()
    out = work / f"model-{kind}-{count}.json"
    run("convert", "--from", "opencv-fisheye" if kind == "fisheye" else "opencv", path, out, "-q")
    return out


def export(kind, count, fmt, loss=True):
    out = work / f"{fmt}-{kind}-{count}"
    sizes = ",".join(f"{w}x{h}" for w, h in SIZES[:count])
    told = run("export", model(kind, count), "--format", fmt, "--size", sizes, "-o", out, "--json", "-q")
    assert not loss or json.loads(told.stdout)["loss"] is None, told.stdout
    return out


def by_opencv(path, count, kind):
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    first = store.getNode("camera_from_world_1").mat()
    for i in range(count):
        end = "" if i == 1 else str(i + 1)
        r, t = (np.eye(3), np.zeros((3, 1))) if i == 0 else (store.getNode("R" + end).mat(), store.getNode("T" + end).mat())
        rvec, tvec = cv2.Rodrigues(r @ first[:, :3])[0], r @ first[:, 3:] + t
        yield pixels(kind, store.getNode(f"K{i+1}").mat(), store.getNode(f"D{i+1}").mat(), rvec, tvec, WORLD)


def by_anipose(path, count, kind):
    from aniposelib.cameras import CameraGroup
    for camera in CameraGroup.load(str(path)).cameras:
        yield camera.project(WORLD).reshape(-1, 2)


def by_pycolmap(path, count, kind):
    import pycolmap
    rec = pycolmap.Reconstruction(str(path))
    for key in sorted(rec.images):
        image = rec.images[key]
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        camera = rec.cameras[image.camera_id]
        # COLMAP counts from the corner of the top-left pixel.
        yield np.array([camera.img_from_cam(pose * p) for p in WORLD]).reshape(-1, 2) - 0.5


def by_kalibr(path, count, kind):
    chain, pose = yaml.safe_load(open(path)), np.eye(4)
    first = np.vstack([np.hstack([cv2.Rodrigues(RVEC[0])[0], TVEC[0][:, None] / 1000]), [0, 0, 0, 1]])
    for i in range(count):
        camera = chain[f"cam{i}"]
        pose = np.array(camera["T_cn_cnm1"]) @ pose if i else pose
        whole = pose @ first
        fx, fy, cx, cy = camera["intrinsics"]
        assert camera["distortion_model"] == ("equidistant" if kind == "fisheye" else "radtan")
        yield pixels(kind, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), camera["distortion_coeffs"],
                     cv2.Rodrigues(whole[:3, :3])[0], whole[:3, 3], WORLD / 1000)


def by_mrcal(path, count, kind):
    for file in sorted(path.glob("*.cameramodel")):
        camera = ast.literal_eval(file.read_text())
        fx, fy, cx, cy, *terms = camera["intrinsics"]
        pose = np.array(camera["extrinsics"])
        yield pixels(kind, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), terms or [0.0] * 5, pose[:3], pose[3:], WORLD)


def by_ros(path, count, kind):
    """Rectified pixels by P, as stereo_image_proc uses it, against the raw ones undistorted by R and P."""
    for i, file in enumerate(sorted(path.glob("*.yaml"))):
        info = yaml.safe_load(open(file))
        k, d, r, p = [np.array(info[n]["data"]).reshape(info[n]["rows"], info[n]["cols"]) for n in
                      ("camera_matrix", "distortion_coefficients", "rectification_matrix", "projection_matrix")]
        left = left if i else (r, cv2.Rodrigues(RVEC[0])[0], TVEC[0] / 1000)
        # World -> left camera -> left rectified -> P; then back through R to the raw picture.
        rectified = (WORLD / 1000 @ left[1].T + left[2]) @ left[0].T
        shifted = rectified + p[:, 3] / p[0, 0]
        yield pixels(kind, k, d.ravel(), cv2.Rodrigues(r.T)[0], np.zeros(3), shifted)
        h = np.column_stack([rectified, np.ones(len(rectified))]) @ p.T
        undo = cv2.fisheye.undistortPoints if kind == "fisheye" else cv2.undistortPoints
        if kind != "fisheye":
            raw = pixels(kind, K[i], D[kind][i], RVEC[i], TVEC[i], WORLD)[:, None]
            criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
            flat = cv2.undistortPointsIter(raw, k, d.ravel(), r, p, criteria)[:, 0] if hasattr(cv2, "undistortPointsIter") else undo(raw, k, d.ravel(), R=r, P=p)[:, 0]
            assert np.abs(flat - h[:, :2] / h[:, 2:]).max() < 1e-3, np.abs(flat - h[:, :2] / h[:, 2:]).max()


def by_dlt(path, count, kind, height=None):
    for column in np.loadtxt(path, delimiter=",").T:
        top = np.append(column, 1).reshape(3, 4) @ np.column_stack([WORLD, np.ones(len(WORLD))]).T
        yield (top[:2] / top[2]).T


def by_dltdv(path, count, kind):
    for i, uv in enumerate(by_dlt(path, count, kind)):
        yield np.column_stack([uv[:, 0] - 1, SIZES[i][1] - uv[:, 1]])


CASES = [
    ("opencv", by_opencv, [0, 4, 5, 8, 12]), ("opencv-fisheye", by_opencv, ["fisheye"]),
    ("anipose", by_anipose, [0, 5, 8, 12, "fisheye"]), ("colmap", by_pycolmap, [0, 4, 5, 8, "fisheye"]),
    ("kalibr", by_kalibr, [0, 4, "fisheye"]), ("mrcal", by_mrcal, [0, 4, 5, 8, 12]), ("ros", by_ros, [0, 5, 8, "fisheye"]),
    ("dlt", by_dlt, [0]), ("dltdv", by_dltdv, [0]),
]
worst = 0.0
for fmt, read, kinds in CASES:
    for kind in kinds:
        for count in ([2] if fmt == "ros" else [2, 3]):
            found = list(read(export(kind, count, fmt), count, kind))
            assert len(found) == count, (fmt, kind, len(found))
            truth = [pixels(kind, K[i], D[kind][i], RVEC[i], TVEC[i], WORLD) for i in range(count)]
            off = max(np.abs(a - b).max() for a, b in zip(found, truth))
            # And back: what is read again is the same model.
            if fmt not in ("ros", "kalibr", "dlt"):
                sizes = ",".join(f"{w}x{h}" for w, h in SIZES[:count])
                run("convert", "--from", fmt, "--size", sizes, work / f"{fmt}-{kind}-{count}", work / "again.json", "-q")
            print(f"{fmt:15} {str(kind):8} {count} cameras: {off:.2e} px")
            worst = max(worst, off)
table = np.round(rng.uniform(0, 1000, (40, 7)), 3)
table[3, 2:4] = np.nan
np.save(work / "table.npy", table)
run("convert", work / "table.npy", work / "table.csv", "-q")
run("convert", work / "table.csv", work / "again.npy", "-q")
assert np.array_equal(np.load(work / "again.npy"), table, equal_nan=True)
print("npy             the same bits")


def remap(kind):
    """Tables of a rectified pair against cv2's own of the same pair; places through Q against the truth."""
    out = export(kind, 2, "remap", loss=False)
    store = cv2.FileStorage(str(out / "pair.yml"), cv2.FILE_STORAGE_READ)
    get = lambda name: store.getNode(name).mat()
    size = tuple(int(store.getNode(name).real()) for name in ("image_width", "image_height"))
    rectified, q, seen, apart = get("rectified_from_world"), get("Q"), [], 0.0
    told = WORLD @ rectified[:, :3].T + rectified[:, 3]
    for i, side in enumerate(("left", "right")):
        x, y = (np.load(out / f"{side}_map_{axis}.npy") for axis in "xy")
        assert x.dtype == y.dtype == np.float32 and x.shape == size[::-1], (x.dtype, x.shape)
        turn = rectified[:, :3] @ cv2.Rodrigues(RVEC[i])[0].T
        init = cv2.fisheye.initUndistortRectifyMap if kind == "fisheye" else cv2.initUndistortRectifyMap
        theirs = init(K[i], np.array(D[kind][i]), turn, get(f"P{i+1}")[:, :3], size, cv2.CV_32FC1)
        shown = x >= 0
        assert shown.mean() > 0.8, shown.mean()
        apart = max(apart, *(np.abs(a - b)[shown].max() for a, b in zip((x, y), theirs)))
        picture = rng.uniform(0, 255, SIZES[i][::-1]).astype(np.uint8)
        assert cv2.remap(picture, x, y, cv2.INTER_LINEAR).shape == size[::-1]
        h = np.column_stack([told, np.ones(len(told))]) @ get(f"P{i+1}").T
        seen.append(h[:, :2] / h[:, 2:])
    assert np.abs(seen[0][:, 1] - seen[1][:, 1]).max() < 1e-9
    hits = np.column_stack([seen[0], seen[0][:, 0] - seen[1][:, 0]])
    off = np.abs(cv2.perspectiveTransform(hits[:, None], q)[:, 0] - told).max()
    r, t = get("R"), get("T")
    assert np.allclose(r, np.eye(3), atol=1e-12) and np.allclose(get("P2")[0, 3], t[0] * get("P2")[0, 0])
    pose = [np.vstack([np.hstack([cv2.Rodrigues(a)[0], b[:, None]]), [0, 0, 0, 1]]) for a, b in zip(RVEC, TVEC)][:2]
    from_first = pose[1] @ np.linalg.inv(pose[0])
    if kind != "fisheye":
        # OpenCV turns the pair about the baseline as it likes; along it the two agree.
        theirs = cv2.stereoRectify(K[0], np.array(D[kind][0]), K[1], np.array(D[kind][1]), SIZES[0], from_first[:3, :3], from_first[:3, 3:])
        own = rectified[:, :3] @ cv2.Rodrigues(RVEC[0])[0].T
        along = abs(own[0] @ theirs[0][0])
        assert along > 1 - 1e-9, along
    print(f"remap           {kind:8} tables {apart:.2e} px from cv2's, places through Q {off:.2e} mm")
    return apart


for kind in (0, 5, 12, "fisheye"):
    assert remap(kind) < 2e-3
try:
    import pyarrow.parquet as parquet
except ImportError:
    print("parquet         not checked: no pyarrow")
else:
    run("convert", work / "table.csv", work / "table.parquet", "-q")
    columns = parquet.read_table(work / "table.parquet").to_pandas().to_numpy(dtype=float)
    assert np.array_equal(columns, table, equal_nan=True)
    for compression in ("snappy", "zstd", "none"):
        whole = parquet.read_table(work / "table.parquet")
        parquet.write_table(whole, work / "theirs.parquet", compression=compression, row_group_size=7)
        run("convert", work / "theirs.parquet", work / "theirs.csv", "-q")
        assert (work / "theirs.csv").read_text() == (work / "table.csv").read_text(), compression
    print("parquet         the same bits")
sys.exit(int(worst > 1e-6))
