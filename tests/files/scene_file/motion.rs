//! Mistakes in keyframes and turntables are told with their line and key, as all others.

use super::assert_message;

/// What a camera moves along, or around, is sound and shows something at each keyframe.
#[test]
fn cameras_that_cannot_move_so() {
    for (text, expected) in [
        (
            "[[camera]]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\n[[camera]]\nposition = [0, 5, 0]\nlook_at = [0, 1, 0]",
            "4: camera[1].up: must not be parallel",
        ),
        ("[[camera]]\nposition = [0, 5, 0]", "1: camera[0].look_at: is required"),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ position = [1, 2, 3] }]",
            "4: camera.keyframes[0].time: is required",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ time = 1, up = [0, 0, 0] }]",
            "4: camera.keyframes[0].up: must not be the zero",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ time = 1, vertical_fov = 30 }, { time = 1 }]",
            "4: camera.keyframes: times must rise, found 1 after 1",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ time = 1 }]",
            "4: camera.keyframes: change nothing",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ time = 2, position = [0, 1, 0] }]",
            "4: camera.keyframes: at time 2, look_at must differ from position",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\ninterpolation = \"smooth\"",
            "4: camera.interpolation: needs keyframes",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nturntable = { frames = 0 }",
            "4: camera.turntable.frames: must be greater than 0",
        ),
        (
            "[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nkeyframes = [{ time = 1, vertical_fov = 30 }]\nturntable = { frames = 9 }",
            "5: camera.turntable: excludes keyframes",
        ),
        ("[animation]\nframes_per_second = 0", "2: animation.frames_per_second: must be greater than 0"),
    ] {
        assert_message(text, expected);
    }
}

/// Models move by whole steps, all of which are sound, and rotations by angles that lead from one to the next.
#[test]
fn models_that_cannot_move_so() {
    for (text, expected) in [
        (
            "[[geometry]]\nfile = \"model.obj\"\nkeyframes = [{ time = 0, scale = 0 }]",
            "3: geometry[0].keyframes[0].scale: must not be 0",
        ),
        ("[[geometry]]\nfile = \"model.obj\"\nkeyframes = []", "3: geometry[0].keyframes: change nothing"),
        (
            "[[geometry]]\nfile = \"model.obj\"\nkeyframes = [{ time = 0, rotate = [0, 1, 0] }, { time = 1, rotate = { axis = [0, 1, 0], degrees = 3 } }]",
            "3: geometry[0].keyframes: all rotations must be three angles, or all about the same axis; not so at time 1",
        ),
        (
            "[[geometry]]\nfile = \"model.obj\"\nmatrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\nkeyframes = [{ time = 0, scale = 2 }]",
            "4: geometry[0].keyframes: excludes matrix",
        ),
    ] {
        assert_message(text, expected);
    }
}
