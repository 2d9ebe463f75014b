import re

import pytest

from reflowshock.cases.hard.trials.packages import MM, aside, board, package
from reflowshock.meshing.board.checks import problems
from reflowshock.meshing.board.parameters import Warpage


def found(the_package, the_board, corner=0.0):
    """Return key -> problem of an assembly with a corner warpage [m]."""
    return {problem.key: problem for problem in problems(the_package, the_board, Warpage(corner=corner))}


def test_sound_parameters_have_no_problem():
    assert not found(package(), aside())
    assert not found(package(), board(), 0.05 * MM)
    assert not found(package(rows=1, columns=1), board(symmetry="full"), -1.0 * MM)
    assert not found(package(depopulated=("B2", "B3", "C2", "C3")), board())


def pad(diameter, mask_opening, definition):
    """Return the table of a pad, from lengths in mm."""
    return {"diameter": diameter * MM, "mask_opening": mask_opening * MM, "definition": definition}


@pytest.mark.parametrize(
    ("changes", "key", "allowed"),
    [
        ({"rows": 3}, "package.rows", "even"),
        ({"columns": 5, "pitch": 0.8 * MM}, "package.columns", "even"),
        ({"depopulated": ("A1",)}, "package.depopulated", "A4, D1 too"),
        ({"depopulated": ("E1",)}, "package.depopulated", "A1 to D4"),
        ({"pitch": 0.47 * MM}, "package.board_pad.diameter", "< 0.47 mm"),
        ({"pitch": 0.55 * MM}, "package.package_pad.diameter", "< 0.55 mm"),
        ({"pitch": 2.0 * MM}, "package.substrate.length", ">= 6.58 mm"),
        ({"die": {"length": 3 * MM, "width": 6 * MM, "thickness": MM}}, "package.die.width", "<= 5 mm"),
        ({"board_pad": pad(0.5, 0.5, "NSMD")}, "package.board_pad.mask_opening", "> 0.5 mm"),
        ({"package_pad": pad(0.4, 0.5, "SMD")}, "package.package_pad.mask_opening", "< 0.4 mm"),
    ],
)
def test_impossible_packages(changes, key, allowed):
    assert found(package(**changes), board())[key].allowed.startswith(allowed)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"length": 4.0 * MM}, "package.substrate.length"),
        ({"length": 9.0 * MM}, "board.length"),
        ({"holes": {"diameter": 2 * MM, "inset_x": 1 * MM, "inset_y": 3 * MM}}, "board.holes.inset_x"),
        ({"holes": {"diameter": 2 * MM, "inset_x": 3 * MM, "inset_y": 13 * MM}}, "board.holes.inset_y"),
        ({"numerics": {"patch_layers": 4, "layers": 4}}, "board.numerics.patch_layers"),
        ({"numerics": {"element_size": 1 * MM, "coarse_size": 0.5 * MM}}, "board.numerics.coarse_size"),
    ],
)
def test_impossible_boards(changes, key):
    assert key in found(package(), board(**changes))


def places(*pairs, diameter=2.0):
    """Return the table of holes at some positions, from lengths in mm."""
    return {"diameter": diameter * MM, "at": [(x * MM, y * MM) for x, y in pairs]}


@pytest.mark.parametrize(
    ("changes", "key", "message"),
    [
        ({"holes": places((-8, -7), (17.0, 10))}, "board.holes.at", "beyond the board along x -10.5 mm to -"),
        ({"holes": places((-8, 0), (14, 10))}, "board.holes.at", "next to the package.* along y"),
        ({"holes": places((-8, -7), (-8, -7))}, "board.holes.at", "could rotate"),
        ({"holes": places((-8, -7), (14, 10), (13, -7))}, "board.holes.at", "neither in line nor apart along x"),
        ({"holes": places() | {"inset_x": MM}}, "board.holes.inset_y", "is missing"),
        ({"holes": places((-8, -7), (14, 10)) | {"inset_x": MM}}, "board.holes.inset_x", "cannot be combined"),
        ({"symmetry": "quarter"}, "board.centre", "in the middle"),
        (
            {"symmetry": "quarter", "centre": (0.0, 0.0), "length": 40 * MM, "width": 30 * MM},
            "board.holes.at",
            "symmetric",
        ),
        ({"centre": (13 * MM, 0.0)}, "board.centre", "reaches beyond the board along its length within 12.5 mm"),
    ],
)
def test_impossible_boards_aside(changes, key, message):
    problem = found(package(), aside(**changes))[key]
    assert re.search(message, f"{problem.message} {problem.allowed}")


def with_holes(diameter, **changes):
    """Return a board with holes of a diameter [mm] near its corners."""
    return board(
        holes={"diameter": diameter * MM, "inset_x": 0.7501 * diameter * MM, "inset_y": 0.7501 * diameter * MM},
        **changes,
    )


@pytest.mark.parametrize("diameter", [9.0, 100.0])
def test_a_hole_and_a_board_that_are_said_to_fit_do(diameter):
    allowed = found(package(), with_holes(diameter))["board.holes.diameter"].allowed
    largest, side, length = re.fullmatch(r"<= (\S+) mm, or board.(\w+) >= (\S+) mm", allowed).groups()
    assert not found(package(), with_holes(0.995 * float(largest)))
    sides = {"length": 1.0, "width": 1.0} | {side: 1.001 * float(length) * MM}
    assert not found(package(), with_holes(diameter, **sides))


def test_a_board_that_is_said_to_be_long_enough_is():
    allowed = found(package(), board(length=9.0 * MM))["board.length"].allowed
    inset = {"diameter": 2.0 * MM, "inset_x": 1.501 * MM, "inset_y": 1.501 * MM}
    assert not found(package(), board(length=1.001 * float(allowed.split()[1]) * MM, holes=inset))


def test_an_inset_between_the_reported_limits_fits():
    holes = {"diameter": 2 * MM, "inset_x": 3 * MM, "inset_y": 13 * MM}
    allowed = found(package(), board(holes=holes))["board.holes.inset_y"].allowed
    least, most = (float(text.split()[0]) for text in allowed.split(" to "))
    assert least < most < 13.0
    for inset in (1.001 * least, 0.999 * most):
        assert not found(package(), board(holes=holes | {"inset_y": inset * MM}))


def test_unknown_joint_names_its_nearest():
    message = found(package(depopulated=("A11",)), board())["package.depopulated"].message
    assert message.endswith("the nearest is A1")


def test_package_touches_the_board_first_at_its_corner():
    # Joints reach 1.5 mm, the substrate 2.5 mm: it comes down (2.5 / 1.5)^2 times as far, with 0.35 mm of room.
    limit = -0.35 * MM * (1.5 / 2.5) ** 2
    assert not found(package(), board(), 0.99 * limit)
    assert found(package(), board(), 1.01 * limit)["warpage.corner"].allowed == "> -0.126 mm"


def test_all_joints_gone():
    nothing = package(rows=2, columns=2, depopulated=("A1", "A2", "B1", "B2"))
    assert found(nothing, board())["package.depopulated"].message == "no joint is left"
