"""Renders scenes by Carpool and by Cycles in turn and prints how they compare; see tools/compare-cycles."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
WAYS = ("carpool", "cycles")


class Failure(Exception):
    pass


def run(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise Failure(f"{command[0]} failed:\n{done.stdout}")
    return done.stdout


def carpool(case, flags, samples, seed, output):
    """Renders; returns what --stats says."""
    stats = output + ".json"
    command = [os.path.join(ROOT, "build/release/bin/carpool"), "render", case["scene"], "-o", output, "--quiet"]
    command += ["--no-png", "--stats", stats, "--size", f"{flags.width}x{flags.height}", "--depth", str(flags.depth)]
    command += ["--samples", str(samples), "--seed", str(seed), "--threads", str(flags.threads)]
    if flags.no_roulette:
        command += ["--roulette", str(flags.depth)]
    for name in ("env", "camera"):
        if case[name]:
            command += ["--" + name, case[name]]
    run(command)
    with open(stats) as file:
        return json.load(file)


def blender(folder, job):
    """One Blender process; returns its records."""
    path = os.path.join(folder, "job.json")
    with open(path, "w") as file:
        json.dump(job, file)
    command = ["blender", "--background", "--factory-startup", "--python-exit-code", "3"]
    text = run(command + ["--python", os.path.join(HERE, "cycles.py"), "--", path])
    return [json.loads(line[7:]) for line in text.splitlines() if line.startswith("CYCLES ")]


def measure(case, flags, folder):
    """Seconds of `flags.samples` samples and their relMSE, for each of the two: lists over the rounds."""

    def at(way, name):
        return os.path.join(folder, f"{way}-{name}.exr")

    view = carpool(case, flags, 1, 0, at("carpool", "view"))["view"]
    job = {"scene": case["scene"], "view": view, "environment": case["env"]}
    job.update(width=flags.width, height=flags.height, depth=flags.depth, threads=flags.threads)
    job["roulette"] = not flags.no_roulette

    def cycles(wanted):
        return blender(folder, {**job, "renders": wanted})

    carpool(case, flags, flags.reference, 1000, at("carpool", "reference"))
    cycles([{"samples": flags.reference, "seed": 1000, "output": at("cycles", "reference")}])
    seconds = {way: [] for way in WAYS}
    for turn in range(1, flags.rounds + 1):
        stats = carpool(case, flags, flags.samples, turn, at("carpool", turn))
        seconds["carpool"].append(stats["seconds"]["render"])
        # Scene and BVH are in both of these, so the difference is sampling alone.
        one, many = cycles(
            [
                {"samples": 1, "seed": turn, "output": at("cycles", "one")},
                {"samples": flags.samples, "seed": turn, "output": at("cycles", turn)},
            ]
        )
        sampling = (many["seconds"] - one["seconds"]) * flags.samples / (flags.samples - 1)
        seconds["cycles"].append(sampling)
    pairs = [
        {"image": at(way, turn), "reference": at(way, "reference"), "way": way}
        for way in WAYS
        for turn in range(1, flags.rounds + 1)
    ]
    errors = {way: [] for way in WAYS}
    for record in blender(folder, {"errors": pairs}):
        errors[record["way"]].append(record["error"])
    return seconds, errors


def rows_of(case, flags, seconds, errors):
    time = {way: statistics.median(seconds[way]) for way in WAYS}
    error = {way: statistics.median(errors[way]) for way in WAYS}
    paths = flags.width * flags.height * flags.samples / 1e6
    speed = time["cycles"] / time["carpool"]
    equal = speed * error["cycles"] / error["carpool"]

    def row(name, value, unit, target=None):
        text = f">= {target}" if target else ""
        return {
            "name": f"{case['label']}: {name}",
            "value": value,
            "unit": unit,
            "target": text,
            "holds": target is None or value >= target,
        }

    return [
        row("speed over Cycles, equal samples", speed, "x", case["target"]),
        row("speed over Cycles, equal relMSE", equal, "x", case["target"]),
        row("Carpool", paths / time["carpool"], "M samples/s"),
        row("Cycles", paths / time["cycles"], "M samples/s"),
        row("Carpool's relMSE", error["carpool"], ""),
        row("Cycles' relMSE", error["cycles"], ""),
    ]


def suite(models, made):
    """Label, file, environment, camera, and how many times as fast as Cycles we mean to be."""
    sun = os.path.join(models, "env/qwantani_afternoon_puresky_1k.hdr")
    garden = os.path.join(models, "env/chinese_garden_1k.hdr")

    def model(name):
        return os.path.join(models, name, name + ".gltf")

    table = [
        ("Cornell box", os.path.join(ROOT, "scenes/cornell_box.gltf"), "", "", 4),
        ("Sponza, camera 0", model("Sponza"), sun, "0", 2.5),
        ("Sponza, camera 1", model("Sponza"), sun, "1", 2.5),
        ("FlightHelmet", model("FlightHelmet"), sun, "", 2.5),
        ("GasStation", model("GasStation"), garden, "", 2.5),
        ("SheenChair", model("SheenChair"), garden, "", 2.5),
        ("64 textured materials", os.path.join(made, "textures.glb"), garden, "", 2.5),
    ]
    return [dict(zip(("label", "scene", "env", "camera", "target"), line)) for line in table]


def parse():
    parser = argparse.ArgumentParser(prog="tools/compare-cycles", description=__doc__)
    parser.add_argument("scenes", nargs="*", help="glTF files (default: a fixed set)")
    parser.add_argument("--env", default="", help="environment map of these files")
    parser.add_argument("--camera", default="", help="camera of these files")
    parser.add_argument("--models", default=os.path.join(ROOT, "../shared/gltf"), help="glTF models of the fixed set")
    parser.add_argument("--generated", default="", help=argparse.SUPPRESS)
    parser.add_argument("--only", default="", help="scenes with this in their name")
    parser.add_argument("--width", type=int, default=512)
    parser.add_argument("--height", type=int, default=512)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--reference", type=int, default=256, help="samples of the images that errors are taken from")
    parser.add_argument("--depth", type=int, default=8, help="scattering vertices")
    parser.add_argument("--no-roulette", action="store_true", help="both follow every path to the full depth")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--json", default="", help="also write the rows to this file")
    return parser.parse_args()


def cases_of(flags):
    if not flags.scenes:
        return [case for case in suite(os.path.abspath(flags.models), flags.generated) if flags.only in case["label"]]
    return [
        {
            "label": os.path.basename(scene),
            "scene": os.path.abspath(scene),
            "env": os.path.abspath(flags.env) if flags.env else "",
            "camera": flags.camera,
            "target": None,
        }
        for scene in flags.scenes
    ]


def main():
    flags = parse()
    rows = []
    print("Cycles: CPU, no clamps, no glossy filter, no adaptive sampling, no denoising. Carpool: the default executor.")
    if flags.no_roulette:
        print("Russian roulette in neither.")
    else:
        print("Russian roulette: Cycles' own from the first bounce on, Carpool's from the second.")
    print("Medians; sampling time alone.")
    for case in cases_of(flags):
        if not os.path.exists(case["scene"]):
            print(f"{case['label']}: skipped, there is no {case['scene']}")
            continue
        with tempfile.TemporaryDirectory() as folder:
            seconds, errors = measure(case, flags, folder)
        for row in rows_of(case, flags, seconds, errors):
            verdict = "" if not row["target"] else "holds" if row["holds"] else "MISSED"
            print(f"{row['name']:<58} {row['value']:>10.3f} {row['unit']:<12} {row['target']:<8} {verdict}", flush=True)
            rows.append(row)
    if flags.json:
        with open(flags.json, "w") as file:
            json.dump(rows, file, indent=1)
    return 0 if all(row["holds"] for row in rows) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failure as failure:
        print(f"compare-cycles: {failure}", file=sys.stderr)
        sys.exit(3)
