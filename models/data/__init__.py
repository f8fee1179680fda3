"""Examples for training: loading, splits, label repair, augmentation, simulation."""
