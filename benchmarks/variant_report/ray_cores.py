"""Which GPUs have no ray tracing cores: their drivers trace Vulkan's rays by shaders. No interface tells it."""

import re

# NVIDIA's GPUs for computing (P100, V100, A30, A100, H20, H100, H200, GH200, B100, B200, GB200), AMD's (CDNA), and
# drivers that run on a CPU.
WITHOUT = re.compile(r"\b(P100|V100|A30|A100|A800|H20|H100|H200|H800|GH200|B100|B200|GB200|MI\d+\w*|llvmpipe)\b")


def without_ray_cores(device):
    """@return "; no RT cores" for devices that have none, else an empty text."""
    return "; no RT cores" if WITHOUT.search(device) else ""
