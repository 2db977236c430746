import numpy as np
import torch

import hiprt

vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
scene = hiprt.build(hiprt.Mesh(vertices, [[0, 1, 2]]))  # On the CPU. The first query copies it to the GPU.

torch.manual_seed(1)
above = torch.rand((1000, 3), device="cuda") + torch.tensor([0.0, 0.0, 1.0], device="cuda")
below = torch.rand((2000, 3), device="cuda") - torch.tensor([0.0, 0.0, 2.0], device="cuda")
blocked = scene.occluded(above[:, None], below - above[:, None], tmin=0, tmax=1)  # All pairs: 1000 x 2000 rays.
hits = scene.cast(above, torch.tensor([0.0, 0.0, -1.0], device="cuda"))
print(f"{blocked.float().mean():.0%} of the pairs on {blocked.device} do not see each other; "
      f"{int(hits.found.sum())} of 1000 points are above the triangle, {hits.t[hits.found].mean():.1f} on average")
