"""The same work in other programs: `frameworks.py NAME COUNT` prints CPU seconds, without their start.

Each is run for a moment first, so that what a framework compiles or sets up is not counted. One thread.
"""
import os, sys, time
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_PLATFORMS"] = "cpu"
import numpy as np

SIZES = [4, 8, 8, 3]


def lesson(real):
    rng = np.random.default_rng(1)
    x = rng.uniform(size=(400, 4))
    t = np.column_stack([0.5 * (x[:, 0] + x[:, 1] * x[:, 2]), 0.5 * (x[:, 1] + x[:, 3] * x[:, 0]),
                         0.3 / (0.5 + x[:, 0] * x[:, 2])])
    w = [rng.uniform(-1, 1, size=(i, o)) for i, o in zip(SIZES, SIZES[1:])]
    b = [rng.uniform(-1, 1, size=o) for o in SIZES[1:]]
    return [v.astype(real) for v in (x, t)] + [[v.astype(real) for v in w], [v.astype(real) for v in b]]


def timed(work, count):
    """CPU seconds of `count`, after a moment of the same."""
    work(max(1, count // 50))
    start = time.process_time()
    work(count)
    return time.process_time() - start


def numpy_training(count):
    x, t, w0, b0 = lesson(np.float32)

    def slopes(w, b):
        a1 = 1 / (1 + np.exp(-(x @ w[0] + b[0])))
        a2 = 1 / (1 + np.exp(-(a1 @ w[1] + b[1])))
        d3 = a2 @ w[2] + b[2] - t
        error = (d3 * d3).mean()
        d3 *= np.float32(2 / d3.size)
        d2 = (d3 @ w[2].T) * a2 * (1 - a2)
        d1 = (d2 @ w[1].T) * a1 * (1 - a1)
        return error, [x.T @ d1, a1.T @ d2, a2.T @ d3], [d1.sum(0), d2.sum(0), d3.sum(0)]

    def work(count):
        w, b, rate = w0, b0, np.float32(0.01)
        error, gw, gb = slopes(w, b)
        for _ in range(count):
            vw = [p - rate * g for p, g in zip(w, gw)]
            vb = [p - rate * g for p, g in zip(b, gb)]
            new, hw, hb = slopes(vw, vb)
            if new > 1.04 * error:
                rate *= np.float32(0.7)
                continue
            if new < error:
                rate *= np.float32(1.05)
            w, b, gw, gb, error = vw, vb, hw, hb, new

    return timed(work, count)


def jax_training(count):
    import jax, jax.numpy as jnp
    x, t, w, b = lesson(np.float32)

    def error(p):
        w, b = p
        a = jax.nn.sigmoid(x @ w[0] + b[0])
        a = jax.nn.sigmoid(a @ w[1] + b[1])
        return jnp.mean((a @ w[2] + b[2] - t) ** 2)

    both = jax.value_and_grad(error)

    def step(_, state):
        p, g, e, rate = state
        v = jax.tree.map(lambda p, g: p - rate * g, p, g)
        new, h = both(v)
        worse = new > 1.04 * e
        keep = lambda old, fresh: jax.tree.map(lambda o, f: jnp.where(worse, o, f), old, fresh)
        rate = jnp.where(worse, rate * 0.7, jnp.where(new < e, rate * 1.05, rate))
        return keep(p, v), keep(g, h), jnp.where(worse, e, new), rate

    @jax.jit
    def run(p, count):
        e, g = both(p)
        return jax.lax.fori_loop(0, count, step, (p, g, e, jnp.float32(0.01)))

    start = (tuple(w), tuple(b))
    return timed(lambda count: jax.block_until_ready(run(start, count)), count)


def torch_training(count):
    import torch
    torch.set_num_threads(1)
    x, t, w, b = lesson(np.float32)
    net = torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.Sigmoid(), torch.nn.Linear(8, 8),
                              torch.nn.Sigmoid(), torch.nn.Linear(8, 3))
    x, t = torch.tensor(x), torch.tensor(t)
    descent = torch.optim.SGD(net.parameters(), lr=0.05)

    def work(count):
        for _ in range(count):
            descent.zero_grad()
            torch.nn.functional.mse_loss(net(x), t).backward()
            descent.step()

    return timed(work, count)


def sklearn_training(count):
    import warnings
    from sklearn.neural_network import MLPRegressor
    warnings.filterwarnings("ignore")
    x, t, _, _ = lesson(np.float32)

    def work(count):
        MLPRegressor(hidden_layer_sizes=(8, 8), activation="logistic", solver="sgd", batch_size=400, max_iter=count, tol=0.0,
                     n_iter_no_change=count + 1, learning_rate_init=0.05).fit(x, t)

    return timed(work, count)


def scipy_steps(count):
    from scipy.optimize import least_squares
    x, t, w0, b0 = lesson(np.float64)
    shapes = [v.shape for v in w0] + [v.shape for v in b0]
    ends = np.cumsum([int(np.prod(s)) for s in shapes])

    def parts(p):
        return [v.reshape(s) for v, s in zip(np.split(p, ends[:-1]), shapes)]

    def forward(p):
        w1, w2, w3, b1, b2, b3 = parts(p)
        a1 = 1 / (1 + np.exp(-(x @ w1 + b1)))
        a2 = 1 / (1 + np.exp(-(a1 @ w2 + b2)))
        return a1, a2, a2 @ w3 + b3

    def errors(p):
        return (forward(p)[2] - t).ravel()

    def slopes(p):
        w1, w2, w3, *_ = parts(p)
        a1, a2, _ = forward(p)
        d3 = np.broadcast_to(np.eye(3), (400, 3, 3))
        d2 = (d3 @ w3.T) * (a2 * (1 - a2))[:, None, :]
        d1 = (d2 @ w2.T) * (a1 * (1 - a1))[:, None, :]
        ws = [(a[:, None, :, None] * d[:, :, None, :]).reshape(1200, -1)
              for a, d in ((x, d1), (a1, d2), (a2, d3))]
        return np.concatenate(ws + [d.reshape(1200, -1) for d in (d1, d2, d3)], axis=1)

    start = np.concatenate([v.ravel() for v in w0 + b0])

    def work(count):
        done = 0
        while done < count:
            found = least_squares(errors, start, slopes, method="trf", xtol=None, ftol=None,
                                  gtol=1e-15, max_nfev=count - done)
            done += found.nfev

    return timed(work, count)


def points(real):
    rng = np.random.default_rng(2)
    return rng.uniform(size=(1_000_000, 4)).astype(real)


def numpy_points(count):
    x, (_, _, w, b) = points(np.float32), lesson(np.float32)

    def work(count):
        for _ in range(count):
            for part in np.array_split(x, 250):
                a = 1 / (1 + np.exp(-(part @ w[0] + b[0])))
                a = 1 / (1 + np.exp(-(a @ w[1] + b[1])))
                a @ w[2] + b[2]

    return timed(work, count)


def torch_points(count):
    import torch
    torch.set_num_threads(1)
    x = torch.tensor(points(np.float32))
    net = torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.Sigmoid(), torch.nn.Linear(8, 8),
                              torch.nn.Sigmoid(), torch.nn.Linear(8, 3))

    def work(count):
        with torch.inference_mode():
            for _ in range(count):
                for part in x.split(4096):
                    net(part)

    return timed(work, count)


def onnx_points(count):
    import onnx, onnxruntime
    from onnx import TensorProto, helper, numpy_helper
    _, _, w, b = lesson(np.float32)
    nodes, held, last = [], [], "x"
    for layer in range(3):
        held += [numpy_helper.from_array(w[layer], f"w{layer}"), numpy_helper.from_array(b[layer], f"b{layer}")]
        nodes.append(helper.make_node("Gemm", [last, f"w{layer}", f"b{layer}"], [f"z{layer}"]))
        last = f"z{layer}"
        if layer < 2:
            nodes.append(helper.make_node("Sigmoid", [last], [f"a{layer}"]))
            last = f"a{layer}"
    values = lambda name, width: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])
    graph = helper.make_graph(nodes, "net", [values("x", 4)], [values(last, 3)], held)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
    parts = np.array_split(points(np.float32), 250)

    def work(count):
        for _ in range(count):
            for part in parts:
                session.run(None, {"x": part})

    return timed(work, count)


def opencv_points(count):
    """Two cameras with Brown's distortion: undistortPoints of both, then triangulatePoints."""
    import cv2
    cv2.setNumThreads(1)
    rng = np.random.default_rng(3)
    world = np.column_stack([rng.uniform(-20, 20, 100_000), rng.uniform(-15, 15, 100_000), rng.uniform(50, 140, 100_000)])
    inner = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
    bend = np.array([-0.2, 0.05, 1e-3, -1e-3, 0.0])
    turn, move = np.array([0.0, 0.05, 0.01]), np.array([-7.0, 0.0, 0.0])
    first, _ = cv2.projectPoints(world, np.zeros(3), np.zeros(3), inner, bend)
    second, _ = cv2.projectPoints(world, turn, move, inner, bend)
    left = np.hstack([np.eye(3), np.zeros((3, 1))])
    right = np.hstack([cv2.Rodrigues(turn)[0], move[:, None]])

    def work(count):
        for _ in range(count):
            a, b = cv2.undistortPoints(first, inner, bend), cv2.undistortPoints(second, inner, bend)
            found = cv2.triangulatePoints(left, right, a.reshape(-1, 2).T, b.reshape(-1, 2).T)
            found[:3] / found[3]

    return timed(work, count)


if __name__ == "__main__":
    print(globals()[sys.argv[1]](int(sys.argv[2])))
