"""Exports the networks of the tests of ONNX, and what PyTorch itself answers for frames of the bundled sample: nothing of this
program takes part, neither in the inputs nor in the answers.

    python3 -m venv /tmp/torch && /tmp/torch/bin/pip install torch==2.4.1 numpy onnx==1.16.2
    cd tests/predictions/onnx && /tmp/torch/bin/python make.py

maps-13 ... maps-18: a convolution over two maps a frame, one file an opset. lift: attention over three frames of fitted joints
(H36M order, mm, a camera's axes, about the pelvis), as networks that lift poses are built. set: two people with a score each, of
three frames of one map in decibels. pppr: the parameters of every joint. open: reads tensors of any size. det: an operator that
few runtimes have.
answers.npz: the joints, m, in the radar's axes, of frames 0 to 3.
"""
import math
import pathlib

import numpy as np
import torch
from torch import nn

HERE = pathlib.Path(__file__).resolve().parent
FRAMES = sorted((HERE.parents[2] / "samples/walk/frames").glob("*.npz"))
SHOWN = 4
N_D = 32
COCO = ("nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist "
        "left_hip right_hip left_knee right_knee left_ankle right_ankle").split()
# The joints of HuPR that COCO has; its neck lies between the shoulders.
HUPR = ("right_hip right_knee right_ankle left_hip left_knee left_ankle neck head left_shoulder left_elbow left_wrist "
        "right_shoulder right_elbow right_wrist").split()


def truth(frame):
    return np.load(FRAMES[frame])["joints"][0].astype(np.float64)


def fits():
    """Parameters of frames 0 to SHOWN: the truth, moved a little; everything else is noise."""
    rng = np.random.default_rng(7)
    made = []
    for frame in range(SHOWN + 1):
        joints = truth(frame) + rng.normal(0, 0.03, (17, 3))
        made.append({
            "position": joints[None],
            "log_scale": rng.normal(-2.5, 0.2, (1, 17, 3)),
            "rotation": np.tile([1.0, 0, 0, 0], (1, 17, 1)) + rng.normal(0, 0.1, (1, 17, 4)),
            "velocity": rng.normal(0, 0.5, (1, 17, 3)),
            "beta": rng.normal(0, 1, (1, 17)),
            "omega": rng.normal(0, 0.3, (1, 17, N_D)),
        })
    return made


def resized(cells, size):
    """Bilinear, the corners of both grids in one place."""
    for axis, bins in enumerate(size):
        at = np.linspace(0, cells.shape[axis] - 1, bins)
        low = np.minimum(np.floor(at).astype(int), cells.shape[axis] - 2)
        part = (at - low).reshape([-1 if k == axis else 1 for k in range(cells.ndim)])
        cells = np.take(cells, low, axis) * (1 - part) + np.take(cells, low + 1, axis) * part
    return cells


def map_of(frame, key):
    return np.load(FRAMES[min(max(frame, 0), len(FRAMES) - 1)])[key].astype(np.float64)


class Maps(nn.Module):
    def __init__(self):
        super().__init__()
        self.body = nn.Sequential(
            nn.Conv2d(2, 4, 5, stride=4, padding=2), nn.BatchNorm2d(4), nn.ReLU(),
            nn.Conv2d(4, 6, 3, stride=2, padding=1), nn.LeakyReLU(0.1), nn.AdaptiveAvgPool2d(2), nn.Flatten(), nn.Dropout(0.3),
            nn.Linear(24, 51))

    def forward(self, x):
        return self.body(x).view(-1, 17, 3)


class Lift(nn.Module):
    def __init__(self, width=24, heads=3):
        super().__init__()
        self.inward, self.norm, self.heads = nn.Linear(51, width), nn.LayerNorm(width), heads
        self.mixed = nn.Linear(width, 3 * width)
        self.outward = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, 51))
        self.place = nn.Parameter(torch.randn(1, 3, width) * 0.1)

    def forward(self, x):
        x = self.inward(x.flatten(2) / 1000) + self.place
        frames, width = x.shape[1], x.shape[2]
        q, k, v = self.mixed(self.norm(x)).view(-1, frames, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        seen = torch.softmax(q @ k.transpose(-1, -2) / math.sqrt(width // self.heads), dim=-1) @ v
        x = x + seen.transpose(1, 2).reshape(-1, frames, width)
        return 1000 * self.outward(x.mean(1)).view(-1, 1, 17, 3)


class Set(nn.Module):
    def __init__(self):
        super().__init__()
        self.seen = nn.Sequential(nn.Conv2d(3, 4, 4, stride=4), nn.SiLU(), nn.AdaptiveMaxPool2d(2), nn.Flatten())
        self.queries = nn.Parameter(torch.randn(1, 2, 16) * 0.3)
        self.joints, self.score = nn.Linear(16, 42), nn.Linear(16, 1)

    def forward(self, x):
        person = self.seen(x).unsqueeze(1) + self.queries
        return self.joints(person), torch.sigmoid(self.score(person)).squeeze(-1)


class Parameters(nn.Module):
    def __init__(self):
        super().__init__()
        self.net = nn.Sequential(nn.Linear(48, 16), nn.Tanh(), nn.Linear(16, 3))

    def forward(self, x):
        return x[..., :3] + 0.01 * self.net(x)


class Open(nn.Module):
    def forward(self, x):
        return x.new_zeros(1, 17, 3) + x.mean()


class Determinant(nn.Module):
    def forward(self, x):
        return x.new_zeros(1, 17, 3) + torch.linalg.det(x[:, 0, :8, :8]).view(-1, 1, 1)


def export(model, inputs, name, names, opset, axes=None):
    torch.onnx.export(model, inputs, str(HERE / f"{name}.onnx"), input_names=names[0], output_names=names[1],
                      opset_version=opset, dynamic_axes=axes, dynamo=False)


def main():
    torch.manual_seed(3)
    answers = {}
    frames = range(SHOWN)

    model = Maps().eval()
    model.body[1].running_mean.normal_()
    model.body[1].running_var.uniform_(0.5, 2)
    maps = np.stack([
        np.stack([resized(cells / cells.max(), (64, 32)) for cells in (map_of(k, "hm_hori"), map_of(k, "hm_vert"))])
        for k in frames])
    maps = torch.tensor((maps - 0.1) / 0.25, dtype=torch.float32)
    for opset in range(13, 19):
        # The batch is of any size, as exporters are usually told.
        export(model, maps[:1], f"maps-{opset}", (["maps"], ["joints"]), opset, {"maps": {0: "batch"}, "joints": {0: "batch"}})
    answers["maps"] = model(maps)

    model = Lift().eval()
    made = fits()
    camera = lambda p: np.stack([-p[..., 1], -p[..., 2], p[..., 0]], -1)
    h36m = lambda p: np.stack([
        p[[11, 12]].mean(0), p[12], p[14], p[16], p[11], p[13], p[15], p[[5, 6, 11, 12]].mean(0), p[[5, 6]].mean(0), p[0],
        p[0], p[5], p[7], p[9], p[6], p[8], p[10]])
    lifted = []
    for k in frames:
        pelvis = made[k]["position"][0][[11, 12]].mean(0)
        around = [made[min(max(k + step, 0), SHOWN)]["position"][0] for step in (-1, 0, 1)]
        read = np.stack([1000 * camera(h36m(p - pelvis)) for p in around])[None]
        out = model(torch.tensor(read, dtype=torch.float32))[0, 0].detach().double().numpy() / 1000
        lifted.append(np.stack([out[:, 2], -out[:, 0], -out[:, 1]], -1) + pelvis)
    export(model, torch.tensor(read, dtype=torch.float32), "lift", (["pose"], ["lifted"]), 17)
    answers["lift"] = np.stack(lifted)

    model = Set().eval()
    told, scores = [], []
    for k in frames:
        around = [map_of(k + step, "hm_hori") for step in (-2, -1, 0)]
        decibels = [np.maximum(20 * np.log10(np.maximum(c, 1e-300) / c.max()), -60) for c in around]
        read = torch.tensor(np.stack([resized(c, (32, 32)) for c in decibels])[None] / 30 + 1, dtype=torch.float32)
        joints, score = model(read)
        told.append(joints[0].detach().numpy())
        scores.append(score[0].detach().numpy())
    export(model, read, "set", (["levels"], ["joints", "scores"]), 16)
    answers["set"], answers["set_scores"] = np.stack(told).reshape(SHOWN, 2, 14, 3), np.stack(scores)

    model = Parameters().eval()
    told = []
    for k in frames:
        p = made[k]["position"][0]
        along = p / np.linalg.norm(p, axis=-1, keepdims=True)
        radial = (made[k]["velocity"][0] * along).sum(-1, keepdims=True)
        beta = made[k]["beta"][0][:, None]
        groups = [made[k][key][0] for key in ("position", "log_scale", "rotation", "velocity")]
        read = np.concatenate([*groups, beta, made[k]["omega"][0], 1 / (1 + np.exp(-beta)), radial], -1)[None]
        told.append(model(torch.tensor(read, dtype=torch.float32))[0].detach().numpy())
    export(model, torch.tensor(read, dtype=torch.float32), "pppr", (["pppr"], ["joints"]), 15)
    answers["pppr"] = np.stack(told)

    export(Open(), maps[:1], "open", (["numbers"], ["joints"]), 13, {"numbers": {k: f"d{k}" for k in range(4)}})
    export(Determinant(), maps[:1], "det", (["maps"], ["joints"]), 13)

    answers = {key: np.asarray(of.detach() if isinstance(of, torch.Tensor) else of, dtype=np.float64) for key, of in answers.items()}
    np.savez_compressed(HERE / "answers.npz", **answers)
    (HERE / "fits").mkdir(exist_ok=True)
    for k, of in enumerate(made):
        np.savez_compressed(HERE / "fits" / f"frames_{FRAMES[k].stem}.npz", **of)


main()
