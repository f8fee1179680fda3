"""Inference engines and the bounded reader of ONNX files."""
