"""One board in every ECAD format: a rotated 10 x 10 array at 0.8 mm, off the centre, next to a coil.

Positions are in mm, y up, with the lower left corner of the board at (0, 0).
"""

import json
from pathlib import Path

from reflowshock.meshing.board.pads import joint_name

LENGTH, WIDTH, THICKNESS = 80.0, 60.0, 1.55
CENTRE = (45.0, 33.0)  # centre of the array
PITCH, PAD, OPENING = 0.8, 0.36, 0.46
HOLES = tuple((x, y) for x in (4.0, 76.0) for y in (4.0, 56.0))
HOLE = 3.2
COIL = (20.0, 30.0)
COIL_PADS = ((-4.0, 0.0), (4.0, 0.0))
MISSING = ("A1", "E5", "E6", "F5", "F6")
NAMES = {joint_name(row, column): (row, column) for row in range(10) for column in range(10)}


def pads(quarter_turns: int = 0) -> dict[str, tuple[float, float]]:
    """Return the positions of the pads of component U8: pin name -> (x, y) [mm].

    Args:
        quarter_turns: Number of counter-clockwise rotations by 90 degrees about the centre of U8.
    """
    pad_lines = {}
    for name, (row, column) in NAMES.items():
        if name not in MISSING:
            x, y = (column - 4.5) * PITCH, (4.5 - row) * PITCH
            for _ in range(quarter_turns):
                x, y = -y, x
            pad_lines[name] = (CENTRE[0] + x, CENTRE[1] + y)
    return pad_lines


def kicad(path: Path, quarter_turns: int = 0, extra: str = "") -> Path:
    """Write the board as KiCad 8 does, with its y axis down and clockwise footprint rotation; return the path.

    Args:
        path: File to write.
        quarter_turns: Number of counter-clockwise rotations of U8 by 90 degrees.
        extra: Text appended to the contents of the board.
    """
    balls = "\n".join(
        f'(pad "{name}" smd circle (at {(column - 4.5) * PITCH:.6f} {(row - 4.5) * PITCH:.6f} {90 * quarter_turns})'
        f' (size {PAD} {PAD}) (layers "F.Cu" "F.Mask") (solder_mask_margin {0.5 * (OPENING - PAD)}))'
        for name, (row, column) in NAMES.items()
        if name not in MISSING
    )
    coil = "\n".join(
        f'(pad "{k}" smd rect (at {x} {-y}) (size 2 3) (layers "F.Cu"))' for k, (x, y) in enumerate(COIL_PADS)
    )
    holes = "\n".join(
        f'(footprint "Hole" (layer "F.Cu") (at {x} {-y})'
        f' (pad "" np_thru_hole circle (at 0 0) (size {HOLE} {HOLE}) (drill {HOLE}) (layers "*.Cu")))'
        for x, y in HOLES
    )
    path.write_text(f"""(kicad_pcb (version 20240108) (generator "pcbnew")
(general (thickness {THICKNESS}))
(setup (pad_to_mask_clearance 0))
(gr_rect (start 0 0) (end {LENGTH} {-WIDTH}) (stroke (width 0.1)) (layer "Edge.Cuts"))
(footprint "BGA:BGA-100" (layer "F.Cu") (at {CENTRE[0]} {-CENTRE[1]} {90 * quarter_turns})
 (property "Reference" "U8" (at 0 0)) (property "Value" "a \\"chip\\"" (at 0 0))
 (fp_rect (start -4.5 -4.5) (end 4.5 4.5) (layer "F.Fab"))
{balls})
(footprint "L" (layer "F.Cu") (at {COIL[0]} {-COIL[1]})
 (property "Reference" "L1") (property "Value" "10 uH") (fp_rect (start -5 -4) (end 5 4) (layer "F.CrtYd"))
{coil})
{holes}
{extra})
""")
    return path


def gerber(folder: Path) -> Path:
    """Write the board as Gerber X2, a drill file and a job file into a folder, which is returned; U8 is not rotated."""
    folder.mkdir(exist_ok=True)

    def layer(function: str, body: str, aperture: float) -> str:
        head = f"%TF.FileFunction,{function}*%\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,{aperture:.6f}*%\n"
        return f"{head}%ADD11R,2.0X3.0*%\nD10*\n{body}M02*\n"

    def flash(at: tuple[float, float]) -> str:
        return f"X{round(1e6 * at[0])}Y{round(1e6 * at[1])}D03*\n"

    balls = "".join(f"%TO.P,U8,{name}*%\n{flash(at)}" for name, at in pads().items())
    coil = "".join(f"%TO.P,L1,{k}*%\n{flash((COIL[0] + x, COIL[1] + y))}" for k, (x, y) in enumerate(COIL_PADS))
    (folder / "top.gtl").write_text(layer("Copper,L1,Top", f"{balls}D11*\n{coil}", PAD))
    (folder / "mask.gts").write_text(layer("Soldermask,Top", "".join(map(flash, pads().values())), OPENING))
    corners = ((0, 0), (LENGTH, 0), (LENGTH, WIDTH), (0, WIDTH), (0, 0))
    lines = [f"X{round(1e6 * x)}Y{round(1e6 * y)}D0{1 if k else 2}*\n" for k, (x, y) in enumerate(corners)]
    (folder / "edge.gm1").write_text(layer("Profile,NP", f"G01*\n{''.join(lines)}", 0.1))
    vias = "".join(f"X{x + 1.0}Y{y + 9.0}\n" for x, y in HOLES)
    holes = "".join(f"X{x}Y{y}\n" for x, y in HOLES)
    tools = "; #@! TA.AperFunction,Plated,PTH,ViaDrill\nT1C2.500\n; #@! TA.AperFunction,NonPlated,NPTH,ComponentDrill\n"
    (folder / "drill.drl").write_text(
        f"M48\n; #@! TF.FileFunction,MixedPlating,1,2\nFMAT,2\nMETRIC\n{tools}T2C{HOLE}\n%\nG90\nG05\n"
        f"T1\n{vias}T2\n{holes}M30\n"
    )
    (folder / "job.gbrjob").write_text(json.dumps({"GeneralSpecs": {"BoardThickness": THICKNESS}}))
    (folder / "picture.png").write_bytes(b"\x89PNG\r\n\xff\xfe")
    return folder


def ipc2581(path: Path, quarter_turns: int = 0) -> Path:
    """Write the board as IPC-2581 with U8 rotated by 90 degrees ``quarter_turns`` times; return the path."""

    def pad(reference: str, pin: str, at: tuple[float, float], shape: str) -> str:
        return (
            f'<Set><Pad padstackDefRef="p"><Location x="{at[0]:.6f}" y="{at[1]:.6f}"/>'
            f'<StandardPrimitiveRef id="{shape}"/>'
            f'<PinRef componentRef="{reference}" pin="{pin}"/></Pad></Set>'
        )

    balls = pads(quarter_turns)
    copper = "".join(pad("U8", name, at, "PAD") for name, at in balls.items())
    copper += "".join(pad("L1", str(k), (COIL[0] + x, COIL[1] + y), "RECT") for k, (x, y) in enumerate(COIL_PADS))
    mask = "".join(pad("U8", name, at, "OPENING") for name, at in balls.items())
    holes = "".join(f'<Hole name="h" diameter="{HOLE}" platingStatus="NONPLATED" x="{x}" y="{y}"/>' for x, y in HOLES)
    holes += '<Hole name="v" diameter="2.5" platingStatus="VIA" x="5" y="13"/>'
    corners = ((0, 0), (LENGTH, 0), (LENGTH, WIDTH), (0, WIDTH), (0, 0))
    steps = "".join(f'<Poly{"StepSegment" if k else "Begin"} x="{x}" y="{y}"/>' for k, (x, y) in enumerate(corners))
    body = "".join(
        f'<Poly{"StepSegment" if k else "Begin"} x="{x}" y="{y}"/>'
        for k, (x, y) in enumerate(((-4.5, -4.5), (4.5, -4.5), (4.5, 4.5), (-4.5, 4.5)))
    )
    path.write_text(f"""<?xml version="1.0" encoding="UTF-8"?>
<IPC-2581 revision="C" xmlns="http://webstds.ipc.org/2581"><Content><DictionaryStandard units="MILLIMETER">
<EntryStandard id="PAD"><Circle diameter="{PAD}"/></EntryStandard>
<EntryStandard id="OPENING"><Circle diameter="{OPENING}"/></EntryStandard>
<EntryStandard id="RECT"><RectCenter width="2" height="3"/></EntryStandard></DictionaryStandard></Content>
<Ecad><CadHeader units="MILLIMETER"/><CadData>
<Layer name="TOP" layerFunction="CONDUCTOR" side="TOP"/><Layer name="MASK" layerFunction="SOLDERMASK" side="TOP"/>
<Layer name="DRILL" layerFunction="DRILL" side="ALL"/><Stackup name="s" overallThickness="{THICKNESS}"/>
<Step name="board"><Profile><Polygon>{steps}</Polygon></Profile>
<Package name="BGA"><Outline><Polygon>{body}</Polygon></Outline></Package>
<Component refDes="U8" packageRef="BGA" layerRef="TOP" part="chip"><Xform rotation="{90 * quarter_turns}"/>
<Location x="{CENTRE[0]}" y="{CENTRE[1]}"/></Component>
<LayerFeature layerRef="TOP">{copper}</LayerFeature><LayerFeature layerRef="MASK">{mask}</LayerFeature>
<LayerFeature layerRef="DRILL"><Set>{holes}</Set></LayerFeature></Step></CadData></Ecad></IPC-2581>
""")
    return path


def table(path: Path) -> Path:
    """Write the board as a CSV table of outline, holes and pads, some lengths in micrometres; return the path."""
    rows = ["kind,reference,pin,x [mm],y [mm],diameter [um],mask_opening [mm]"]
    rows += [f"outline,,,{x},{y},," for x, y in ((0, 0), (LENGTH, 0), (LENGTH, WIDTH), (0, WIDTH))]
    rows += [f"hole,,,{x},{y},{1e3 * HOLE:.0f}," for x, y in HOLES]
    rows += [f"pad,U8,{name},{x:.6f},{y:.6f},{1e3 * PAD:.0f},{OPENING}" for name, (x, y) in pads().items()]
    rows += [f"pad,L1,{k},{COIL[0] + x},{COIL[1] + y},2764," for k, (x, y) in enumerate(COIL_PADS)]
    path.write_text("\n".join(rows) + "\n")
    return path
