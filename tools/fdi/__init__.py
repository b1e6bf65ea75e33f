"""Proofs of the certified impact speeds that ship."""
