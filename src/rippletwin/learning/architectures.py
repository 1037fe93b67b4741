"""The ten classifiers of the paper in numbers: title, domain, first layer, residual blocks.

Source: Dong, Tao, Liu, "Digital Twin-Driven Zero-Shot Fault Diagnosis of Axial Piston Pumps Using
Fluid-Borne Noise Signals", tables of CNN1D (341@100) and CNN2D (3x3@1) with their notes. ``k@s``
names the kernel and stride of the first convolution; the architectures of one domain differ in
nothing else but the residual blocks that follow it. Tables and pictures need these numbers and not
the networks, whose library takes seconds to import.
"""

from __future__ import annotations

from dataclasses import dataclass

CLASSES = ("H", "S", "C1", "C2")


@dataclass(frozen=True)
class Architecture:
    """One row of the paper's accuracy table."""

    title: str  # as the paper prints it
    domain: str  # "time": (n, channels, M) windows; "image": (n, channels, size, size)
    kernel: int  # of the first convolution
    stride: int
    padding: int  # on either side; circular on time windows (one revolution is a period)
    blocks: tuple[int, ...] = ()  # residual blocks in each stage; none: the plain network

    @property
    def silence(self) -> float:
        """Value of an input without any ripple: 0 in time, exp(0) in an image."""
        return 1.0 if self.domain == "image" else 0.0

    @property
    def family(self) -> str:
        """Which of the two sets of training settings it takes: "residual" or "plain"."""
        return "residual" if self.blocks else "plain"


# 1D: 1536 is half a revolution on either side, the one padding that gives the table's (64, 59) for
# kernel 341, stride 100 and 3072 points; 150@50 gives (64, 59) without any.
ARCHITECTURES: dict[str, Architecture] = {
    "cnn1d_341_100": Architecture("CNN1D (341@100)", "time", 341, 100, 1536),
    "cnn1d_150_50": Architecture("CNN1D (150@50)", "time", 150, 50, 0),
    "cnn1d_3_1": Architecture("CNN1D (3@1)", "time", 3, 1, 1),
    "resnet18_1d": Architecture("ResNet18 (341@100)", "time", 341, 100, 1536, (2, 2, 2, 2)),
    "resnet34_1d": Architecture("ResNet34 (341@100)", "time", 341, 100, 1536, (3, 4, 6, 3)),
    "cnn2d_3_1": Architecture("CNN2D (3×3@1)", "image", 3, 1, 1),
    "cnn2d_7_2": Architecture("CNN2D (7×7@2)", "image", 7, 2, 3),
    "cnn2d_30_3": Architecture("CNN2D (30×30@3)", "image", 30, 3, 14),
    "resnet18_2d": Architecture("ResNet18 (3×3@1)", "image", 3, 1, 1, (2, 2, 2, 2)),
    "resnet34_2d": Architecture("ResNet34 (3×3@1)", "image", 3, 1, 1, (3, 4, 6, 3)),
}

LONGEST_TRAININGS = (
    "resnet34_2d",
    "resnet18_2d",
    "cnn2d_30_3",
    "cnn1d_3_1",
    "cnn2d_3_1",
    "resnet34_1d",
)
"""Networks that take longest to train on two cores, the longest first: they are started first."""
