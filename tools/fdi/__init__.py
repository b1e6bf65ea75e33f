"""Searches behind the certified impact speeds that ship."""
