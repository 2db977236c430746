import numpy as np

import hiprt

vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
scene = hiprt.build(hiprt.Mesh(vertices, [[0, 1, 2]]))

x, y = np.meshgrid([0.1, 0.4, 0.8], [0.1, 0.4, 0.8])
origins = np.stack((x, y, np.full_like(x, 2)), axis=-1).astype(np.float32)  # 3 x 3 rays
hits = scene.cast(origins, np.array([0, 0, -1], np.float32))
print(f"{hits.found.sum()} of 9 rays hit; t = {hits.t[0, 0]:.3f}, primitive {hits.primitive[0, 0]}")
