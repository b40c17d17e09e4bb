"""Sets up object, light and camera in Blender 4.2 or newer.

    blender --python scene.py                                    # to look at it
    blender --background --python scene.py -- rendered.png       # to render it
"""

import math
import pathlib
import sys

import bpy

GLB = @GLB@
LIGHT = @LIGHT@
STRENGTH = @STRENGTH@

here = pathlib.Path(__file__).resolve().parent
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=str(here / GLB))
scene = bpy.context.scene

world = bpy.data.worlds.new("light")
scene.world = world
if hasattr(world, "use_nodes") and not world.use_nodes:
    world.use_nodes = True
nodes, links = world.node_tree.nodes, world.node_tree.links
background = nodes["Background"]
background.inputs["Strength"].default_value = STRENGTH
if LIGHT is None:
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
else:
    environment = nodes.new("ShaderNodeTexEnvironment")
    environment.image = bpy.data.images.load(str(here / LIGHT))
    mapping = nodes.new("ShaderNodeMapping")
    # The middle of the panorama is what the camera looks at: Blender's +y. Blender has it at +x.
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, -math.pi / 2)
    coordinates = nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    links.new(environment.outputs["Color"], background.inputs["Color"])

camera = bpy.data.cameras.new("camera")
camera.type = "ORTHO"
camera.ortho_scale = 1.0
eye = bpy.data.objects.new("camera", camera)
eye.location = (0.0, -2.0, 0.0)
eye.rotation_euler = (math.pi / 2, 0.0, 0.0)
scene.collection.objects.link(eye)
scene.camera = eye

scene.render.engine = "CYCLES"
scene.cycles.samples = 64
scene.render.resolution_x = @WIDTH@
scene.render.resolution_y = @HEIGHT@
scene.render.film_transparent = True
scene.view_settings.view_transform = "Standard"

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
if arguments:
    scene.render.filepath = str(pathlib.Path(arguments[0]).resolve())
    bpy.ops.render.render(write_still=True)
