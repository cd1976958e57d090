"""Shortest ways that are not ours: pygeodesic has the exact algorithm of Mitchell, Mount and
Papadimitriou as Danil Kirsanov wrote it; its lengths are compared with those of `tumble route`.

    python3 routes.py TUMBLE FOLDER
"""

import json
import pathlib
import subprocess
import sys

import numpy as np
import pygeodesic.geodesic as geodesic

TUMBLE, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
BOUND = 1e-9
random = np.random.default_rng(1)
worst = 0.0


def terrain(width, roughness):
    y, x = np.mgrid[0:width, 0:width].astype(float)
    z = 2 * np.sin(x / 3) * np.cos(y / 4) + roughness * random.random((width, width))
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    at = np.arange(width * width).reshape(width, width)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return points, faces.reshape(-1, 3)


def sphere(width, roughness):
    """A closed lump: a grid round an axis, with the poles."""
    u, v = np.mgrid[1:width, 0 : 2 * width]
    radius = 1 + roughness * random.random(u.shape)
    polar, around = np.pi * u / width, np.pi * v / width
    points = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1
    ) * radius[..., None]
    points = np.concatenate([points.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    at = np.arange((width - 1) * 2 * width).reshape(width - 1, -1)
    right = np.roll(at, -1, axis=1)
    faces = [np.stack([at[:-1], at[1:], right[1:]], -1), np.stack([at[:-1], right[1:], right[:-1]], -1)]
    caps = [np.stack([np.full(2 * width, len(points) - 2), at[0], right[0]], -1)]
    caps.append(np.stack([np.full(2 * width, len(points) - 1), right[-1], at[-1]], -1))
    return points, np.concatenate([part.reshape(-1, 3) for part in faces + caps])


def compare(name, points, faces, pairs, polygons=None):
    """`polygons` are the faces that the program gets, where they are not pygeodesic's."""
    global worst
    obj, list_, out = FOLDER / f"{name}.obj", FOLDER / f"{name}.txt", FOLDER / name
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    given = faces.tolist() if polygons is None else polygons
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in given]
    obj.write_text("\n".join(lines))
    rows = [" ".join(map(repr, points[[a, b]].reshape(-1).tolist())) for a, b in pairs]
    list_.write_text("\n".join(rows))
    command = [TUMBLE, "route", obj, "--pairs", list_, "-o", out, "--json"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    algorithm = geodesic.PyGeodesicAlgorithmExact(points, faces)
    for (a, b), own in zip(pairs, found, strict=True):
        expected, _ = algorithm.geodesicDistance(a, b)
        error = abs(own["length"] - expected) / expected
        worst = max(worst, error)
        if error > BOUND:
            sys.exit(f"{name}: {a} to {b}: {own['length']!r}, and pygeodesic has {expected!r}")


def pairs(count, vertices):
    return [tuple(random.choice(vertices, 2, replace=False).tolist()) for _ in range(count)]


for number, (width, roughness) in enumerate([(12, 0.3), (25, 1.0), (25, 3.0), (50, 1.0), (20, 0.0)]):
    points, faces = terrain(width, roughness)
    compare(f"terrain{number}", points, faces, pairs(12, len(points)))
for number, (width, roughness) in enumerate([(8, 0.0), (12, 0.3), (16, 1.0)]):
    points, faces = sphere(width, roughness)
    compare(f"lump{number}", points, faces, pairs(12, len(points)))


def prism(corners):
    """A star about the z axis, with a bottom, a top and walls: faces of up to 12 corners, many of them
    concave, for the program; and triangles about the middles of bottom and top, which are cut apart from
    it, for pygeodesic."""
    angles = (np.arange(corners) + random.uniform(0.1, 0.9, corners)) * 2 * np.pi / corners
    radii, height = random.uniform(0.4, 2.0, corners), random.uniform(0.1, 1.5)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], -1)
    tilt = np.linalg.qr(random.normal(size=(3, 3)))[0]
    level = lambda z: np.concatenate([ring, np.full((corners, 1), z)], -1)
    middles = np.array([[0, 0, 0], [0, 0, height]])
    points = np.concatenate([level(0.0), level(height), middles]) @ tilt
    low, high = list(range(corners)), list(range(corners, 2 * corners))
    turn = int(random.integers(corners))
    polygons, triangles = [(low[turn:] + low[:turn])[::-1], high[turn:] + high[:turn]], []
    for i in range(corners):
        a, b = low[i], low[(i + 1) % corners]
        c, d = high[(i + 1) % corners], high[i]
        polygons.append([a, b, c, d])
        triangles += [(a, b, c), (a, c, d), (2 * corners, b, a), (2 * corners + 1, d, c)]
    return points, polygons, np.array(triangles)


for number in range(200):
    points, polygons, triangles = prism(int(random.integers(4, 13)))
    count = len(points) - 2
    compare(f"prism{number}", points, triangles, pairs(3, count), polygons)
print(f"routes: {worst:.1e}")
