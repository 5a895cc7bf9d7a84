"""Makes the reference cases of `objective = "ncc_db"` and `"gamma"` anew: the formulas in float64 by JAX, gradients by
automatic differentiation, nothing of this program. Or tells what one of them costs: an iteration of the same mathematics
(gradient and Adam's step) compiled by XLA for all cores, in float32 and within the EM region, as one line of JSON.

    python3 levels.py mmvr-size
    python3 levels.py levels-ncc-db time

Every second row and column of the case `mmvr-size` becomes `levels-ncc-db` (amplitudes that add) and `levels-gamma` (powers
that add), each with its own answers.
"""
import json
import pathlib
import sys
import time
import tomllib

import jax
import jax.numpy as jnp
import numpy as np

C = 299792458.0
COORDINATES = {"x": [0], "y": [1], "z": [2], "depth_h": [0, 2], "depth_v": [0, 1]}
CASES = {"levels-ncc-db": ("ncc_db", "coherent"), "levels-gamma": ("gamma", "incoherent")}


def rotation(q):
    w, x, y, z = q / jnp.linalg.norm(q)
    return jnp.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def joint_map(p, log_scale, q, v, beta, omega, view, radar, box):
    """Amplitude and phase of one joint in the cells of a box of a view that stands where the world does."""
    R, psf = rotation(q), view["psf"]
    sigma = R @ jnp.diag(jnp.exp(2 * log_scale)) @ R.T
    d, rho = jnp.sqrt(p @ p), jnp.hypot(p[0], p[1])
    az, el, u = jnp.arctan2(p[1], p[0]), jnp.arctan2(p[2], rho), p / d
    e_az = jnp.array([-jnp.sin(az), jnp.cos(az), 0.0])
    e_el = jnp.array([-jnp.sin(el) * jnp.cos(az), -jnp.sin(el) * jnp.sin(az), jnp.cos(el)])
    sigma += psf["range_m"] ** 2 * jnp.outer(u, u) + (d * psf["elevation_rad"] / jnp.cos(el)) ** 2 * jnp.outer(e_el, e_el)
    sigma += (rho * psf["azimuth_rad"] / jnp.cos(az)) ** 2 * jnp.outer(e_az, e_az)
    bins, rows, steps = [], [], []
    for axis in view["axes"]:
        of = np.array(COORDINATES[axis["kind"]])
        at = lambda x, of=of: x[of[0]] if len(of) == 1 else jnp.sqrt((x[of] ** 2).sum())
        steps.append((axis["hi"] - axis["lo"]) / axis["bins"])
        bins.append((at(p) - axis["lo"]) / steps[-1])
        rows.append(jax.grad(at)(p))
    rows, steps = jnp.stack(rows), np.array(steps)
    G = rows / steps[:, None]
    cov = G @ sigma @ G.T + jnp.eye(2) / 12
    amplitude = jax.nn.sigmoid(beta) * (radar["r_max_m"] / d) ** 4 / (2 * jnp.pi * jnp.sqrt(jnp.linalg.det(cov)))
    lam, tau = C / (radar["start_hz"] + radar["bandwidth_hz"] / 2), 2 * d / C
    phase = (2 * jnp.pi * radar["bandwidth_hz"] / radar["chirp_s"] * tau * tau
             + 4 * jnp.pi * (v @ u) / lam * radar["frame_s"]
             + 2 * jnp.pi / lam * (radar["l_az_m"] * jnp.sin(az) + radar["l_el_m"] * jnp.sin(el)))
    kappa = omega.mean() * (rows @ v) * steps
    cells = jnp.stack(jnp.meshgrid(*(jnp.arange(of.start, of.stop) - b for of, b in zip(box, bins)), indexing="ij"), -1)
    reached = jnp.exp(-0.5 * jnp.einsum("xya,ab,xyb->xy", cells, jnp.linalg.inv(cov), cells))
    return amplitude * reached, phase + cells @ kappa


def whole(view):
    return tuple(slice(0, axis["bins"]) for axis in view["axes"])


def simulate(par, view, radar, summation, box):
    joints = [x.reshape((-1,) + x.shape[2:]) for x in (par[k] for k in ("position", "log_scale", "rotation", "velocity", "beta", "omega"))]
    k, phase = jax.vmap(lambda *joint: joint_map(*joint, view, radar, box))(*joints)
    if summation == "incoherent":
        return jnp.sqrt((k * k).sum(0) + 1e-30)
    return jnp.sqrt((k * jnp.cos(phase)).sum(0) ** 2 + (k * jnp.sin(phase)).sum(0) ** 2 + 1e-30)


def levels(kind, S, I, n):
    M = jnp.maximum((I - n).sum(), 1e-6 * I.sum()) / (S.sum() + 1e-20) * S + n
    if kind == "gamma":
        I = jnp.where(I > 0, I, 1e-12)
        return (jnp.log(M) + I / M - jnp.log(I) - 1).mean()
    a, b = (jnp.log(x) - jnp.log(x).mean() for x in (I + n, M + n))
    return 1 - (a * b).sum() / jnp.sqrt((a * a).sum() * (b * b).sum() + 1e-20)


def region(view, par, half_width_m):
    position = par["position"][0]
    centre = (position.min(0) + position.max(0)) / 2
    def along(axis):
        at = axis["lo"] + np.arange(axis["bins"]) * (axis["hi"] - axis["lo"]) / axis["bins"]
        middle = np.sqrt((centre[np.array(COORDINATES[axis["kind"]])] ** 2).sum()) if len(COORDINATES[axis["kind"]]) > 1 else centre[COORDINATES[axis["kind"]][0]]
        inside = np.nonzero(abs(at - middle) <= half_width_m)[0]
        return slice(inside[0], inside[-1] + 1)
    return tuple(along(axis) for axis in view["axes"])


def kinematics(par, skeleton, theta_max_deg):
    p, v = par["position"][0], par["velocity"][0]
    bones, angles = np.array(skeleton["bones"]), np.array(skeleton["angles"])
    psi = lambda x: jnp.sqrt(x * x + 1e-6) - 1e-3
    e, dv = p[bones[:, 0]] - p[bones[:, 1]], v[bones[:, 0]] - v[bones[:, 1]]
    length = jnp.sqrt((e * e).sum(-1) + 1e-12)
    a, b = p[angles[:, 0]] - p[angles[:, 1]], p[angles[:, 2]] - p[angles[:, 1]]
    theta = jnp.arctan2(jnp.sqrt((jnp.cross(a, b) ** 2).sum(-1) + 1e-12), (a * b).sum(-1))
    return {"bone": psi(length - np.array(skeleton["bone_lengths_m"])).sum(), "rigid": psi((dv * e).sum(-1) / length).sum(),
            "joint": (jnp.maximum(0, theta - np.deg2rad(theta_max_deg)) ** 2).sum()}


def objective(manifest, fit, frame, boxes):
    """The loss and L_EM, functions of the parameters."""
    measured = []
    for view, box in zip(manifest["view"], boxes):
        heat = frame[view["array"]].astype(np.float64)
        h = heat[box].max()
        measured.append(((heat[box] / h) ** 2, np.percentile((heat / h) ** 2, 30)))

    def em(par):
        simulated = [simulate(par, view, manifest["radar"], fit["summation"], box) ** 2 for view, box in zip(manifest["view"], boxes)]
        return sum(levels(fit["objective"], S, *of) for S, of in zip(simulated, measured)) / len(measured)

    def total(par):
        return fit["w_em"] * em(par) + fit["w_kine"] * sum(kinematics(par, manifest["skeleton"], fit["theta_max_deg"]).values())

    return total, em


def answers(manifest, fit, frame, par):
    views = manifest["view"]
    boxes = [region(view, par, fit["em_region"]["half_width_m"]) for view in views]
    total, em = objective(manifest, fit, frame, boxes)
    out = {"loss": total(par), "em": em(par), "sep": 0.0, "coll": 0.0, **kinematics(par, manifest["skeleton"], fit["theta_max_deg"])}
    for prefix, of in (("grad", total), ("grad_em", em)):
        out |= {f"{prefix}_{key}": value for key, value in jax.grad(of)(par).items()}
    for view, box in zip(views, boxes):
        maps = (frame[view["array"]].astype(np.float64), np.asarray(simulate(par, view, manifest["radar"], fit["summation"], whole(view))))
        ori, sim = (x[box] > np.percentile(x[box], 100 - fit["tau_pct"]) for x in maps)
        out |= {f"sim_{view['array']}": maps[1], f"iou_{view['array']}": (ori & sim).sum() / (ori | sim).sum()}
    return {key: np.asarray(value, np.float64) for key, value in out.items()}


def opened(case):
    return [tomllib.loads((case / file).read_text()) for file in ("dataset.toml", "fit.toml")]


def timed(case, iterations=200):
    manifest, fit = opened(case)
    par = {key: np.asarray(value, np.float32) for key, value in np.load(case / "params.npz").items()}
    boxes = [region(view, par, fit["em_region"]["half_width_m"]) for view in manifest["view"]]
    total, _ = objective(manifest, fit, np.load(case / "frames" / "000000.npz"), boxes)

    @jax.jit
    def step(t, par, m, v):
        loss, g = jax.value_and_grad(total)(par)
        m = jax.tree.map(lambda a, b: 0.9 * a + 0.1 * b, m, g)
        v = jax.tree.map(lambda a, b: 0.999 * a + 0.001 * b * b, v, g)
        move = lambda x, a, b: x - 1e-3 * (a / (1 - 0.9**t)) / (jnp.sqrt(b / (1 - 0.999**t)) + 1e-8)
        return loss, jax.tree.map(move, par, m, v), m, v

    m, v = (jax.tree.map(jnp.zeros_like, par) for _ in range(2))
    _, par, m, v = step(1.0, par, m, v)
    times = []
    for t in range(2, iterations + 2):
        begun = time.perf_counter()
        loss, par, m, v = step(float(t), par, m, v)
        loss.block_until_ready()
        times.append((time.perf_counter() - begun) * 1e6)
    cells = [int(np.prod([of.stop - of.start for of in box])) for box in boxes]
    print(json.dumps({"peer": "jax " + jax.__version__, "cells": cells, "us_min": round(min(times), 1), "us_median": round(float(np.median(times)), 1), "loss": float(loss)}))


def main(source, mode="cases"):
    source, here = pathlib.Path(source), pathlib.Path(__file__).parent
    if mode == "time":
        return timed(source)
    jax.config.update("jax_enable_x64", True)
    text, frame = (source / "dataset.toml").read_text(), np.load(source / "frames" / "000000.npz")
    for name, (objective, summation) in CASES.items():
        case = here / name
        (case / "frames").mkdir(parents=True, exist_ok=True)
        thinned = text.replace("bins = 256", "bins = 128").replace("bins = 128, lo = 0.98", "bins = 64, lo = 0.98").replace("bins = 128, lo = -1.98", "bins = 64, lo = -1.98")
        (case / "dataset.toml").write_text(thinned.replace('name = "mmvr-size"', f'name = "{name}"'))
        (case / "fit.toml").write_text((source / "fit.toml").read_text().replace('summation = "coherent"', f'summation = "{summation}"\nobjective = "{objective}"'))
        maps = {key: frame[key][::2, ::2] if key.startswith("hm_") else frame[key] for key in frame}
        np.savez_compressed(case / "frames" / "000000.npz", **maps)
        par = dict(np.load(source / "params.npz"))
        np.savez_compressed(case / "params.npz", **par)
        manifest, fit = opened(case)
        np.savez_compressed(case / "expected.npz", **answers(manifest, fit, maps, {k: jnp.asarray(v) for k, v in par.items()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
