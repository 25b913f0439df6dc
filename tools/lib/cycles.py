"""Renders a glTF scene by Cycles on the CPU, as tools/compare-cycles asks; run inside Blender.

blender --background --factory-startup --python cycles.py -- JOB.json

The job names the scene, the camera as Carpool placed it ("view"), the environment map, size, depth, threads, and the
renders wanted: [{"samples", "seed", "output"}]; or {"errors": [{"image", "reference"}]} to compare images. Prints one
line per render, with its seconds, or per pair, with its relMSE.
"""

import json
import math
import os
import sys
import time

import bpy
import mathutils
import numpy

if not hasattr(numpy, "bool"):  # Blender 3.4's glTF importer wants the name that NumPy 1.24 dropped
    numpy.bool = bool


def empty_world():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    return scene


def read_gltf(path):
    """The JSON of a .gltf or .glb."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:4] == b"glTF":
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    return json.loads(data)


def importable(path, folder):
    """The file, or a copy without the required extensions that nothing in it uses: the importer refuses those."""
    gltf = read_gltf(path)
    unused = set(gltf.get("extensionsRequired", [])) - set(gltf.get("extensionsUsed", []))
    if not unused or not path.endswith(".gltf"):
        return path
    gltf["extensionsRequired"] = [name for name in gltf["extensionsRequired"] if name not in unused]
    for record in gltf.get("buffers", []) + gltf.get("images", []):
        if "uri" in record and not record["uri"].startswith("data:"):
            record["uri"] = os.path.join(os.path.dirname(os.path.abspath(path)), record["uri"])
    copy = os.path.join(folder, os.path.basename(path))
    with open(copy, "w") as file:
        json.dump(gltf, file)
    return copy


def glows(record):
    return any(record.get("emissiveFactor", [])) or "emissiveTexture" in record


def make_lambertian(tree, principled):
    """Principled's diffuse lobe is Disney's, which is no Lambertian one."""
    color, metallic = principled.inputs["Base Color"], principled.inputs["Metallic"]
    if metallic.is_linked or metallic.default_value != 0:
        return
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = color.default_value
    for link in color.links:
        tree.links.new(link.from_socket, diffuse.inputs["Color"])
    for link in list(principled.outputs["BSDF"].links):
        tree.links.new(diffuse.outputs["BSDF"], link.to_socket)


def set_reflectance(gltf):
    """The importer leaves out KHR_materials_ior; Principled's `specular` is F0 / 0.08."""
    for record in gltf.get("materials", []):
        extensions = record.get("extensions", {})
        ior = extensions.get("KHR_materials_ior", {}).get("ior", 1.5)
        factor = extensions.get("KHR_materials_specular", {}).get("specularFactor", 1)
        material = bpy.data.materials.get(record.get("name", ""))
        if material is None or material.node_tree is None or (ior, factor) == (1.5, 1):
            continue
        reflectance = ((ior - 1) / (ior + 1)) ** 2 * factor
        for node in [n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"]:
            node.inputs["Specular"].default_value = reflectance / 0.08
            if reflectance == 0 and not glows(record):
                make_lambertian(material.node_tree, node)


def place_camera(scene, view):
    """glTF's y is up, Blender's z: (x, y, z) becomes (x, -z, y)."""
    columns = [view[name] for name in ("right", "up", "back", "position")]
    x, y, z = ([column[i] for column in columns] for i in range(3))
    matrix = mathutils.Matrix([x, [-v for v in z], y, [0, 0, 0, 1]])
    data = bpy.data.cameras.new("view")
    data.sensor_fit = "VERTICAL"
    data.clip_start, data.clip_end = 1e-4, 1e6
    if view["projection"] == "perspective":
        data.angle_y = 2 * math.atan(view["half_height"])
    else:
        data.type = "ORTHO"
        data.ortho_scale = 2 * view["half_height"]
    camera = bpy.data.objects.new("view", data)
    camera.matrix_world = matrix
    scene.collection.objects.link(camera)
    scene.camera = camera


def light_world(world, environment):
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = nodes["Background"]
    if not environment:
        background.inputs["Strength"].default_value = 0
        return
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(environment)
    turn = nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value = (0, 0, -math.pi / 2)
    place = nodes.new("ShaderNodeTexCoord")
    links.new(place.outputs["Generated"], turn.inputs["Vector"])
    links.new(turn.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])


def settle(scene, job):
    """Everything that would trade bias for noise is off."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    bounces = max(job["depth"] - 1, 0)  # Carpool counts the first vertex too
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = 1024
    if not job["roulette"]:
        cycles.min_light_bounces = bounces + 1
        cycles.min_transparent_bounces = 1024


def render(scene, samples, seed, output):
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.render.filepath = output
    begin = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    return time.perf_counter() - begin


def read_rgb(path):
    image = bpy.data.images.load(path)
    pixels = numpy.empty(image.size[0] * image.size[1] * 4, numpy.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(-1, 4)[:, :3].astype(numpy.float64)


def relative_error(image, reference):
    """Mean squared error over squared value, with a hundredth of the mean against division by black."""
    a, b = read_rgb(image), read_rgb(reference)
    return float(numpy.mean((a - b) ** 2 / (b**2 + (0.01 * b.mean()) ** 2)))


def main():
    job_path = sys.argv[sys.argv.index("--") + 1]
    with open(job_path) as file:
        job = json.load(file)
    for pair in job.get("errors", []):
        error = relative_error(pair["image"], pair["reference"])
        print("CYCLES " + json.dumps({**pair, "error": error}), flush=True)
    if "scene" not in job:
        return
    scene = empty_world()
    bpy.ops.import_scene.gltf(filepath=importable(job["scene"], os.path.dirname(job_path)))
    set_reflectance(read_gltf(job["scene"]))
    place_camera(scene, job["view"])
    light_world(scene.world, job["environment"])
    settle(scene, job)
    for wanted in job["renders"]:
        seconds = render(scene, wanted["samples"], wanted["seed"], wanted["output"])
        print("CYCLES " + json.dumps({**wanted, "seconds": seconds}), flush=True)


main()
