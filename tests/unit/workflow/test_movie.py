"""A scene of the report as a GIF."""

import numpy as np
from PIL import Image

from reflowshock.processes import ProcessPool
from reflowshock.workflow.report.movie import SIZE, write_movie
from reflowshock.workflow.report.scene import Field, Group, Scene


def test_a_scene_as_a_gif(tmp_path):
    """Each frame shows its own state; the focal point stays in the middle, however far all of it moves."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    moved = np.stack([np.zeros_like(points), points * [0.0, 0.0, 0.5] + [0.0, 0.0, 50.0]])
    values = {"stress": np.array([[0.0] * 4, [1.0] * 4])}
    plate = Group("solder", points, np.array([[0, 1, 2, 3]]), np.zeros(4, int), displacement=moved, values=values)
    ghost = Group("board", points - [0, 0, 1], np.array([[0, 1, 2, 3]]), np.zeros(4, int), is_ghost=True)
    scene = Scene([plate, ghost], ["a"], [Field("stress", "MPa", 0.0, 1.0)], ["0 ms", "1 ms"], view=(1.0, 1.0, 1.0))
    with ProcessPool(1) as pool:  # VTK draws no text in a process that has loaded DOLFINx, as this may have
        pool.submit(write_movie, scene, tmp_path / "drop.gif").result()
    with Image.open(tmp_path / "drop.gif") as movie:
        assert (movie.n_frames, movie.size) == (2, SIZE)
        middles = []
        for frame in range(2):
            movie.seek(frame)
            picture = np.asarray(movie.convert("RGB"), int)
            middles.append(picture[SIZE[1] // 2, SIZE[0] // 2])
    assert np.abs(middles[0] - [0x44, 0x01, 0x54]).max() < 40  # the lower end of the scale, then the upper one
    assert np.abs(middles[1] - [0xFD, 0xE7, 0x25]).max() < 40
